"""Knowledge as YAML: comments with units and meanings."""

from __future__ import annotations

from builders.knowledge import SAND, content, parsed
from nrdf.process.knowledge_file import (
    write_knowledge,
)


def test_yaml_says_quantities_as_people_read_them_and_explains_each_field_once(tmp_path):
    given = parsed(process={**SAND, "tilt_deg": 10})
    write_knowledge(tmp_path / "k.yaml", given)
    text = (tmp_path / "k.yaml").read_text()
    assert "stepover_m: 0.015  # 15 mm\n" in text and "# 10°" in text
    assert "passes" not in text
    region = content()["regions"][0]
    given = parsed(regions=[{**region, "processes": [SAND, SAND]}])
    write_knowledge(tmp_path / "k.yaml", given, explained=True)
    text = (tmp_path / "k.yaml").read_text()
    assert text.count("Distance between neighbouring lines") == 1
    assert "# force_n:" in text and text.count("passes: 1") == 1
    assert max(map(len, text.splitlines())) <= 100
