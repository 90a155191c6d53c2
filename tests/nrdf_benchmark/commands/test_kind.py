"""`nrdf eval kind` as a user runs it."""

from __future__ import annotations

import json

from builders.labelled_boxes import write_objects
from nrdf import cli


def test_chairs_are_checked_as_they_are_and_turned_and_stools_as_others(tmp_path, capsys):
    root = write_objects(tmp_path / "objects")
    out = tmp_path / "kind.json"
    words = f"eval kind --category chair --labelled {root} --out {out}"
    assert cli.run(words.split()) == 0
    shown = capsys.readouterr().out
    assert "with a warning" in shown and "all turned objects" in shown
    content = json.loads(out.read_text())
    rows = {row["what"]: (row["warned"], row["of"]) for row in content["summary"]}
    assert rows["all real objects of the kind"][1] == 2
    assert rows["all turned objects"][1] == 2 * 9 and rows["labelled meshes: stool"][1] == 1
    assert rows["all turned objects"][0] >= 12
    assert len(content["clouds"]) == 2 * (1 + 9 + 1) + 1


def test_scans_need_meshes(capsys):
    assert cli.run(["eval", "kind", "--category", "chair", "--scans-every", "3"]) == 2
    assert "give their folder as --shapes" in " ".join(capsys.readouterr().err.split())
