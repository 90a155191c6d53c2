"""What lies over the objects: what it shows, and what it is asked to do."""

from __future__ import annotations

import html
import json
from contextlib import nullcontext
from types import SimpleNamespace

import pytest

from builders.studio_page import small_box


@pytest.fixture
def asks(page, monkeypatch):
    """Asks as the page of browser 7 does."""
    answers = page.server.page.answers
    client = SimpleNamespace(
        client_id=7, camera=SimpleNamespace(image_width=780, image_height=600), atomic=nullcontext,
        add_notification=lambda *words, **more: None,
    )  # fmt: skip
    monkeypatch.setattr(page.server, "get_clients", lambda: {7: client})
    return lambda what, **values: answers[what]({"client": "7", **values})


def state(page):
    held = page.studio.panel.overlay._state.content
    return json.loads(html.unescape(held.partition('="')[2].partition('"')[0]))


def done(page):
    """Wait for what was asked."""
    page.studio.panel.inputs._executor.submit(lambda: None).result(10)


def test_tools_are_taken_and_shown(page, asks):
    assert state(page)["tool"] == "Orbit"
    asks("tool", name="Lasso")
    done(page)
    assert page.studio.mouse.tool == "Lasso" == state(page)["tool"]
    assert [words for words, _ in state(page)["legend"]] == ["top", "front", "in several regions"]


def test_who_may_only_look_changes_nothing(page, asks):
    page.studio.pen.opened(7)
    asks("only_look")
    asks("tool", name="Brush")
    done(page)
    assert page.studio.mouse.tool == "Orbit"


def test_of_two_pages_one_works_until_the_other_takes_the_pen(page, asks):
    page.studio.pen.opened(3)
    page.studio.pen.opened(7)
    asks("tool", name="Brush")
    done(page)
    assert page.studio.mouse.tool == "Orbit" and page.studio.panel.overlay.content()["pen"] == 3
    asks("take_pen")
    done(page)
    assert state(page)["pen"] == 7 and not page.server.may_change(3)
    asks("tool", name="Brush")
    done(page)
    assert page.studio.mouse.tool == "Brush"


def test_what_is_no_outline_is_refused(page, asks):
    for points in ("1,2;3", "a,b;c,d;e,f", "nan,0;1,1;0,1"):
        with pytest.raises(ValueError):
            asks("lasso", points=points)
    assert asks("lasso", points="0,0;1,1") == {}


def test_a_browser_that_has_gone_is_not_answered(page):
    with pytest.raises(KeyError):
        page.server.page.answers["tool"]({"client": "3", "name": "Grow"})


def test_targets_have_pictures_and_the_most_doubtful_comes_first(page, asks):
    assert state(page)["targets"] == [], "one needs no strip"
    page.editor.add_target("other.ply", small_box(1.2, seed=2))
    page.does(page.studio.sync)
    page.transfer()
    overlay = page.studio.panel.overlay
    overlay.thumbnails._executor.submit(lambda: None).result(60)
    targets = state(page)["targets"]
    assert {name for name, *_ in targets} == {"new", "other"} and all(row[2] for row in targets)
    assert asks("thumbnail", name="other").startswith(b"\x89PNG")
    found = page.studio.results.by_target

    def least(name):
        regions = found[name].transfer_result.regions.values()
        return min(0.0 if r.missing else r.match.score for r in regions)

    doubtful = [bool(found[name].uncertain_regions) for name, *_ in targets]
    if doubtful[0] == doubtful[1]:
        assert least(targets[0][0]) <= least(targets[1][0])
    else:
        assert doubtful[0]
    asks("target", name="other")
    done(page)
    assert page.studio.visible_objects() == ["reference", "other"]
    assert [row[0] for row in state(page)["targets"] if row[3]] == ["other"]
    asks("target", name="")
    done(page)
    assert page.studio.shown_target is None


def test_the_time_line_has_a_part_for_each_path_and_jumps(page, asks, playback, monkeypatch):
    simulation, jumps = page.studio.arm_simulation, []
    assert state(page)["line"] == []
    simulation._arm_view = SimpleNamespace(playback=playback)
    simulation.shown = True
    page.editor.rename_region("top", playback.report["paths"][0]["region"])
    (part,) = page.studio.panel.overlay.content()["line"]
    start, long, colour, words, missed = part
    assert start == 0.0 and long == pytest.approx(playback.seconds, abs=0.02)
    assert words.startswith("top, sand: ") and colour == "#e69f00"
    path = playback.report["paths"][0]
    assert missed == (path["reached"] < path["waypoints"])
    monkeypatch.setattr(simulation, "seek", jumps.append)
    monkeypatch.setattr(simulation, "on_time", lambda: None)
    asks("seek", time="1.5")
    done(page)
    assert jumps == [1.5]
    with pytest.raises(ValueError):
        asks("seek", time="nan")
    simulation._arm_view = None
