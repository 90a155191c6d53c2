"""What a line is measured on."""

from __future__ import annotations

from pathlib import PurePath

import numpy as np

from builders.labelled_boxes import write_objects
from nrdf.cell.file import read_cell
from nrdf.cell.rules import choose_knowledge, missing_tools, read_choices
from nrdf.io.cloud import read_cloud
from nrdf_benchmark.line.objects import write_light_cell, write_light_objects, write_meshes


def test_light_objects_are_small_different_and_taken_by_their_cell(tmp_path):
    write_light_objects(tmp_path / "inbox", 5, 0)
    files = sorted((tmp_path / "inbox").iterdir())
    clouds = [read_cloud(file) for file in files]
    assert [len(cloud) for cloud in clouds] == [2048] * 5
    assert {cloud.unit for cloud in clouds} == {"m"}
    assert not np.allclose(clouds[0].points, clouds[4].points, atol=1e-3)
    cell = write_light_cell(tmp_path)
    choices = read_choices(read_cell(cell), tmp_path)
    assert choose_knowledge(choices, PurePath(files[0].name)).file == tmp_path / "light.yaml"
    assert not missing_tools(read_cell(cell), choices)


def test_meshes_are_stretched(tmp_path):
    write_meshes(tmp_path / "inbox", write_objects(tmp_path / "data"), ["chair"], 3, 0)
    names = sorted(path.name for path in (tmp_path / "inbox").iterdir())
    assert [name[:6] for name in names] == ["chair-"] * 3
