"""Cell files: begun, written with comments, read again."""

from __future__ import annotations

import pytest

from builders.cells import cell_of
from nrdf.bundled import KNOWLEDGE
from nrdf.cell.file import new_cell, read_cell, write_cell
from nrdf.errors import ProcessError
from nrdf.process.knowledge_file import read_knowledge


def test_a_written_cell_reads_as_the_same_and_explains_each_field_once(tmp_path):
    cell = cell_of(keep_out=[{"name": "fence", "centre_m": [0, 1, 1], "size_m": [2, 0.1, 2]}])
    write_cell(tmp_path / "cell.yaml", cell)
    assert read_cell(tmp_path / "cell.yaml") == cell
    text = (tmp_path / "cell.yaml").read_text()
    assert text.count("# Least share of each whole region") == 1
    assert max(map(len, text.splitlines())) <= 110


def test_a_new_cell_has_the_tools_that_the_knowledge_names(tmp_path):
    cell = new_cell([KNOWLEDGE], "mine", ["krl"], tmp_path)
    said = read_knowledge(KNOWLEDGE)
    named = {process.tool.name for region in said.regions for process in region.processes}
    assert {tool.name for tool in cell.tools} == named
    assert (tmp_path / cell.knowledge[0].file).resolve() == KNOWLEDGE.resolve()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[1, 2]", "must hold a mapping"),
        ("version: 2\nname: x", "has version 2"),
        ("a: [", "not valid YAML"),
        ("name: x\nobject: {fixture_m: [1, 0, 0]}\ntools: [{name: gun}]", r"tools\.'gun'\.tcp_m"),
    ],
)
def test_a_file_that_is_wrong_is_refused(tmp_path, text, said):
    (tmp_path / "cell.yaml").write_text(text)
    with pytest.raises(ProcessError, match=said):
        read_cell(tmp_path / "cell.yaml")
    with pytest.raises(ProcessError, match="nrdf cell new"):
        read_cell(tmp_path / "other.yaml")
