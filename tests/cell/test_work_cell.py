"""The cell file's format: what is refused, and in which words."""

from __future__ import annotations

import math

import pytest

from builders.cells import cell_of
from nrdf.errors import ProcessError

LEFT = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]]
SKEW = [[1, 0.2, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
FAR = [[1, 0, 0, 800], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
TOOL = {"name": "a", "tcp_m": [0, 0, 0.1]}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"object": {"T_base_object": LEFT}}, "left-handed frame, a mirror image"),
        ({"object": {"T_base_object": SKEW}}, "unit vectors at right angles"),
        ({"object": {"T_base_object": FAR}}, "metres, not mm"),
        ({"object": {}}, "either T_base_object or fixture_m"),
        ({"tools": [TOOL, TOOL]}, "two tools are called 'a'"),
        ({"tools": [{"name": "a", "tcp_m": [0, 0, 150]}]}, "tool 'a': tcp_m"),
        ({"tool": []}, "unknown key 'tool'; did you mean 'tools'"),
        (
            {"knowledge": [{"file": f, "names": ["Chair-*"]} for f in ("a.yaml", "b.yaml")]},
            "a.yaml and b.yaml both claim objects named 'Chair-",
        ),
    ],
)
def test_what_is_wrong_is_said(changes, said):
    with pytest.raises(ProcessError, match=said):
        cell_of(**changes)


def test_limits_are_those_of_a_transfer_and_tools_are_numbered():
    cell = cell_of(limits={"max_turn_deg": 30, "min_coverage": 0.9, "require_all": False})
    assert cell.limits.limits.max_turn_rad == pytest.approx(math.pi / 6)
    assert cell.limits.limits.min_coverage == 0.9 and not cell.limits.limits.require_all
    assert cell.tool_numbers == {"disc 125": 1, "camera": 7, "gun": 2}
