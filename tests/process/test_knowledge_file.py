"""Knowledge files: read with every fault named, written and read again."""

from __future__ import annotations

from pathlib import Path

import pytest

from builders.knowledge import SAND, TAUGHT, content, parsed
from nrdf.errors import ProcessError
from nrdf.process.knowledge_file import (
    KNOWLEDGE_FILE,
    read_knowledge,
    write_knowledge,
)
from nrdf.process.process import Process

BOMB = "a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1]\n" + "".join(
    f"{name}: &{name} [{', '.join(['*' + before] * 9)}]\n"
    for before, name in zip("abcdefgh", "bcdefghi", strict=True)
)


def test_thousands_of_faults_make_a_short_message():
    with pytest.raises(ProcessError) as caught:
        parsed(**{f"k{number}" + "x" * 1000: 1 for number in range(5000)})
    said = str(caught.value).splitlines()
    assert said[0] == "k.yaml: 5000 faults:" and said[-1].strip() == "and 4988 more"
    assert len(said) == 14 and max(map(len, said)) < 500


def test_every_fault_is_listed_at_once():
    given = {**SAND, "feed_mm_s": 0, "passes": 0}
    with pytest.raises(ProcessError) as caught:
        parsed(process=given, catgory="x")
    said = str(caught.value)
    assert said.startswith("k.yaml: 3 faults:\n") and len(said.splitlines()) == 4


def test_numbers_with_exponents_and_anchors_are_read_as_meant():
    text = """
        category: chair
        reference: {cloud: ref.ply}
        regions:
          - name: seat
            indices: [0]
            processes:
              - &sand {kind: sand, stepover_m: 15e-3, tool: {radius_m: .25e-1}, feed_m_s: 1e-1}
              - {<<: *sand, kind: oil}
    """
    sand, oil = KNOWLEDGE_FILE.parse(text, "k").regions[0].processes
    assert (sand.stepover_m, sand.tool.radius_m, sand.feed_m_s) == (0.015, 0.025, 0.1)
    assert oil.kind == "oil" and oil.stepover_m == 0.015


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: [", "is not valid YAML"),
        ("3", "must hold a mapping"),
        ("category: a\ncategory: b", "the key 'category' occurs twice, again in line 2"),
        ("category: &a [*a]", "within its own anchor"),
        (BOMB, "aliases included"),
        ("a: !!python/object/apply:os.getcwd []", "is not valid YAML"),
    ],
)  # fmt: skip
def test_yaml_that_is_broken_or_hostile_is_refused(text, message):
    with pytest.raises(ProcessError) as caught:
        KNOWLEDGE_FILE.parse(text, "k.yaml")
    assert message in str(caught.value)


def test_a_missing_file_and_one_that_is_no_text(tmp_path):
    with pytest.raises(ProcessError, match="nrdf teach"):
        read_knowledge(tmp_path / "none.yaml")
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ProcessError, match="no text in UTF-8"):
        read_knowledge(tmp_path / "binary.yaml")
    (tmp_path / "cut.json").write_text('{"version": 1, ')
    with pytest.raises(ProcessError, match="not valid JSON"):
        read_knowledge(tmp_path / "cut.json")


@pytest.mark.parametrize("ending", ["yaml", "json"])
@pytest.mark.parametrize("explained", [False, True])
def test_what_is_written_is_read_again(tmp_path, ending, explained):
    oil = {
        **SAND,
        "kind": "oil",
        "parameters": {"oil": "linseed: raw", "coats": [1, 2], "on": True},
    }
    custom = {**TAUGHT, "kind": "custom", "name": "no: yes", "direction": [0.1, 0, 1e-7]}
    region = content()["regions"][0]
    second = {"name": "back", "mask": [True, False], "processes": [custom]}
    third = {"name": "legs", "points_m": [[0.25, 1, 0]], "processes": [SAND]}
    regions = [{**region, "processes": [SAND, oil]}, second, third]
    given = parsed(regions=regions, allow_overlap=True)
    path = tmp_path / f"k.{ending}"
    write_knowledge(path, given, explained)
    assert read_knowledge(path) == given
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_the_file_in_the_documentation_is_right():
    text = (Path(__file__).parents[2] / "docs" / "guides" / "teach.md").read_text(encoding="utf-8")
    (region,) = KNOWLEDGE_FILE.parse(text.split("```yaml\n")[1].split("```")[0], "docs").regions
    assert [process.kind for process in region.processes] == ["sand", "oil"]
    fields = set(Process.model_fields) - {"label"}
    assert all(f"`{field}`" in text for field in fields), "docs/guides/teach.md leaves out a field"
