"""Which knowledge an object is for."""

from __future__ import annotations

from pathlib import PurePath

import pytest

from builders.cells import cell_of
from nrdf.bundled import KNOWLEDGE
from nrdf.cell.rules import choose_knowledge, missing_tools, read_choices
from nrdf.errors import ProcessError


def cell_with(tmp_path, *rules):
    for rule in rules:
        text = KNOWLEDGE.read_text().replace("category: chair", f"category: {rule.pop('is')}")
        (tmp_path / rule["file"]).write_text(text + "\nallow_unusual: true\n")
    return cell_of(knowledge=list(rules))


def test_names_come_before_categories_and_folders_count(tmp_path):
    cell = cell_with(
        tmp_path,
        {"file": "c.yaml", "is": "chair"},
        {"file": "s.yaml", "is": "shelf"},
        {"file": "x.yaml", "is": "chair", "names": ["special-*"]},
    )
    choices = read_choices(cell, tmp_path)

    def chosen(name):
        return choose_knowledge(choices, PurePath(name)).file.name

    assert chosen("chair-17.ply") == "c.yaml" and chosen("Shelf/17.ply") == "s.yaml"
    assert chosen("chair/special-1.ply") == "x.yaml"
    with pytest.raises(ProcessError, match=r"no knowledge file of the cell is for '17\.ply'"):
        chosen("17.ply")
    with pytest.raises(ProcessError, match="no knowledge file"):
        chosen("chairman.ply")
    with pytest.raises(ProcessError, match="both claim"):
        chosen("shelf/chair-1.ply")


def test_two_files_for_one_category_are_refused(tmp_path):
    rules = [{"file": f, "is": "chair"} for f in ("a.yaml", "b.yaml")]
    with pytest.raises(ProcessError, match="are both for every chair"):
        read_choices(cell_with(tmp_path, *rules), tmp_path)


def test_the_only_knowledge_is_for_every_object_and_missing_tools_are_named(tmp_path):
    cell = cell_with(tmp_path, {"file": "c.yaml", "is": "chair"})
    choices = read_choices(cell, tmp_path)
    assert choose_knowledge(choices, PurePath("17.ply")).file.name == "c.yaml"
    assert any("the cell has no tool 'spray gun'" in line for line in missing_tools(cell, choices))
