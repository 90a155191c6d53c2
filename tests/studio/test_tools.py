"""The tools: each has a key of its own."""

from __future__ import annotations

import pytest

from nrdf.studio.tools import ACTS, ERASE, TOOLS, tool


def test_every_tool_has_a_name_and_a_key_of_its_own():
    every = (*TOOLS, ERASE, *ACTS)
    assert len({each.key for each in every}) == len({each.name for each in every}) == len(every)
    assert tool("Lasso").key == "L"
    with pytest.raises(KeyError):
        tool("Hammer")
