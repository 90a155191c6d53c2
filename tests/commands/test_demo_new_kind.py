"""The demonstration's last part: a kind without a model."""

from __future__ import annotations

from nrdf.commands.demo_new_kind import FOLDER, transfer_new_kind
from nrdf.io.cloud import read_cloud
from nrdf.process.bound_knowledge import read_bound_knowledge


def test_a_table_is_painted_without_a_model_of_tables(tmp_path):
    found = transfer_new_kind(tmp_path, {})
    assert "no model for the category 'table'" in found.note
    assert found.iou > 0.95 and found.coverage > 0.99
    place = tmp_path / FOLDER
    assert read_bound_knowledge(place / "table.yaml").knowledge.category == "table"
    assert len(read_cloud(place / "job" / "regions" / "top.ply")) > 1000
    assert (place / "picture.png").stat().st_size > 10_000
