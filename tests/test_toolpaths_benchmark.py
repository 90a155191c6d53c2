"""The figures of planned tool paths, by command."""

from __future__ import annotations

import pytest

from nrdf import cli
from nrdf.benchmark.toolpaths import BARS, plan_regions
from nrdf.process.plan import Strategy


@pytest.fixture(scope="module")
def planned():
    return plan_regions("car", Strategy(stepover_m=0.05, spacing_m=0.03, tool_radius_m=0.05), 1)


def test_every_region_is_planned_or_named(planned):
    found, faults = planned
    assert len(found) >= 3 and len({item.region for item in found}) == len(found)
    for item in found:
        assert item.item == "car 1000000" and 0 < item.measures.coverage <= 1
        assert set(item.meets(0.05)) == set(BARS)
    assert all("car 1000000, " in fault for fault in faults)


def test_a_bar_is_kept_or_not(planned):
    item = max(planned[0], key=lambda item: item.measures.line_spacing_worst_m or 0.0)
    worst = item.measures.line_spacing_worst_m
    assert item.meets(worst)["spacing"] and not item.meets(worst / 2)["spacing"]


def test_the_command_prints_every_bar(capsys):
    words = "eval toolpaths --category car --members 1 --stepover-mm 60 --radius-mm 60"
    assert cli.run(words.split()) == 0
    said = " ".join(capsys.readouterr().out.split())
    for bar in BARS.values():
        assert f"{bar}: " in said
    assert "s to plan a region" in said
