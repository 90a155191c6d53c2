"""Plans on the reference, transfers to targets, and what is saved, without a browser."""

from __future__ import annotations

import json
import zipfile
from io import BytesIO

import numpy as np
import pytest

import nrdf
from builders.taught_box import SIZE, cloud, faces
from nrdf.errors import ProcessError, RegionError
from nrdf.process.bound_knowledge import read_bound_knowledge
from nrdf.process.transfer import ProcessTransfer
from nrdf.studio.computing import Computing
from nrdf.studio.document import REFERENCE
from nrdf.studio.drawing import colours_of, direction_of, lines_of, title_of
from nrdf.studio.editor import Desk
from nrdf.studio.result_cache import Bench
from nrdf.studio.saving import save_job, save_picture, save_programs, zipped
from nrdf.studio.session import Session
from nrdf.studio.teaching import lesson_of
from nrdf.studio.worker import Cancelled
from nrdf.toolpath.file import read_toolpaths


def silent(done, total):
    """Progress that nobody looks at."""


@pytest.fixture
def bench(tmp_path, untrained):
    desk = Desk(Session(tmp_path / "session"))
    desk.open_reference("box.ply", cloud(), "chair")
    for name, kind in (("top", "sand"), ("front", "oil")):
        desk.add_region(name)
        mask = np.zeros(len(cloud()), bool)
        mask[faces(cloud())[name]] = True
        desk.paint(REFERENCE, name, mask)
        desk.restart_step(name, 0, kind)
    desk.add_target("new.ply", cloud(1.1 * SIZE, seed=1))
    return Bench(desk, Computing(lambda category: nrdf.load_model(untrained)))


def test_plans_hold_as_long_as_what_they_are_of(bench):
    desk = bench.desk
    bench.make_plans(desk.document, silent)
    top, front = desk.document.regions
    plan = bench.plan(top, 0)
    assert not plan.fault and plan.checked.measures.coverage > 0.9 and plan.lines
    desk.change_numbers("top", 0, {"stepover_mm": 20.0})
    desk.recolour_region("front", (1, 2, 3))
    top, front = desk.document.regions
    assert bench.plan(top, 0) is None and bench.plan(front, 0) is not None
    bench.make_plans(desk.document, silent)
    assert bench.plan(desk.document.regions[0], 0).checked.process.stepover_m == 0.02


def test_a_plan_that_cannot_be_is_told_by_field_and_value(bench):
    bench.desk.change_numbers("top", 0, {"feed_mm_s": 0.0})
    bench.desk.change_numbers("front", 0, {"edge_margin_mm": 900.0})
    bench.make_plans(bench.desk.document, silent)
    top, front = bench.desk.document.regions
    assert "region 'top', process 1 (sand), feed_m_s" in bench.plan(top, 0).fault
    assert "edge_margin_m is 0.9, which leaves nothing" in bench.plan(front, 0).fault


def test_planning_can_be_cancelled_and_keeps_what_is_done(bench):
    def until_second(done, total):
        if done == 1:
            raise Cancelled

    with pytest.raises(Cancelled):
        bench.make_plans(bench.desk.document, until_second)
    top, front = bench.desk.document.regions
    assert bench.plan(top, 0) is not None and bench.plan(front, 0) is None


def test_a_transfer_holds_until_what_was_taught_changes(bench):
    desk, seen = bench.desk, []
    bench.transfer(desk.document, lambda done, total: seen.append((done, total)))
    assert bench.is_current("new") and seen[-1][0] > seen[0][0]
    paths = bench.results["new"].transferred.paths
    assert [path.region for path in paths] == ["top", "front"]
    first = bench.results["new"]
    desk.recolour_region("top", (9, 9, 9))
    assert bench.is_current("new"), "colours do not count"
    bench.transfer(desk.document, silent)
    assert bench.results["new"] is first
    desk.change_numbers("top", 0, {"stepover_mm": 20.0})
    assert not bench.is_current("new")
    bench.transfer(desk.document, silent)
    assert bench.is_current("new")


def test_a_region_painted_on_the_target_is_taken_as_it_is(bench):
    desk = bench.desk
    bench.transfer(desk.document, silent)
    body = desk.body("new")
    mask = np.zeros(len(body.cloud), bool)
    mask[faces(body.cloud)["top"]] = True
    desk.paint("new", "top", mask)
    assert not bench.is_current("new")
    bench.transfer(desk.document, silent)
    top = bench.results["new"].transferred.regions["top"]
    assert top.match.method == "marked" and top.match.score == 1.0
    np.testing.assert_array_equal(top.match.indices, np.flatnonzero(mask))
    desk.paint("new", "top", np.zeros_like(mask))
    bench.transfer(desk.document, silent)
    assert bench.results["new"].transferred.regions["top"].missing == "marked as not there"
    assert "top" in bench.results["new"].doubtful
    assert "look at" in title_of(desk, bench, "new")


def test_a_marked_region_must_be_taught_and_on_the_target(bench, untrained):
    lesson = lesson_of(bench.desk.session.clouds, bench.desk.document)
    teacher, target = ProcessTransfer(lesson, nrdf.load_model(untrained)), cloud(seed=1)
    with pytest.raises(RegionError, match="no taught region 'lid'; known: top, front"):
        teacher.transfer(target, marked={"lid": [1, 2]})
    with pytest.raises(RegionError, match=r"region 'top' on the target: .*are not on"):
        teacher.transfer(target, marked={"top": [[9.0, 9.0, 9.0]]})


def test_an_incomplete_document_is_refused(bench):
    bench.desk.change_numbers("top", 0, {"feed_mm_s": -1.0})
    with pytest.raises(ProcessError, match=r"region 'top', process 1 \(sand\), feed_m_s"):
        bench.transfer(bench.desk.document, silent)


def test_likeness_is_greatest_around_the_point_itself(bench):
    document = bench.desk.document
    described = bench.described(document, silent)
    away = described.unlike(17)[REFERENCE]
    # An untrained C finds each of a shape's points on the same shape again.
    assert away.argmin() == 17 and away[17] == pytest.approx(0, abs=1e-5)
    assert described.unlike(18)[REFERENCE].argmin() == 18, "for another point at once"
    assert list(described.objects) == [REFERENCE]
    bench.transfer(document, silent)
    found = bench.described(document, silent)
    assert found.unlike(17)["new"].shape == (len(bench.desk.body("new").points),)
    assert found.objects[REFERENCE] is described.objects[REFERENCE], "computed once"


def test_what_is_drawn(bench):
    desk = bench.desk
    bare = colours_of(desk, bench, "new")
    assert (bare == bare[0]).all() and not lines_of(desk, bench, "new")
    bench.make_plans(desk.document, silent)
    bench.transfer(desk.document, silent)
    assert set(lines_of(desk, bench, REFERENCE)) == {"top", "front"}
    painted = colours_of(desk, bench, REFERENCE)
    assert (painted[desk.document.region("top").mask] != bare[0]).any()
    assert direction_of(desk, "top", 0) is None
    desk.change_step("top", 0, direction=[1.0, 0.0, 0.0])
    start, stop = direction_of(desk, "top", 0)
    np.testing.assert_allclose((stop - start) / np.linalg.norm(stop - start), [1, 0, 0])
    sure = colours_of(desk, bench, "new", by_confidence=True)
    assert len(sure) == len(desk.body("new").points)


def test_overlaps_are_dark(bench):
    from nrdf.studio.colours import SHARED

    desk = bench.desk
    desk.paint(REFERENCE, "front", desk.document.region("top").mask)
    drawn = colours_of(desk, bench, REFERENCE)
    assert (drawn[desk.document.region("top").mask] == SHARED.astype(np.uint8)).all()


def test_what_is_saved_can_be_read_by_the_command_line(bench):
    desk = bench.desk
    bench.make_plans(desk.document, silent)
    bench.transfer(desk.document, silent)
    result = bench.results["new"]
    place = save_job(desk, "new", result, {"command": "nrdf studio"})
    assert save_job(desk, "new", result, {}) == place, "it can be saved again"
    assert len(read_toolpaths(place).paths) == 2 and (place / "report.html").is_file()
    assert list(read_bound_knowledge(place / "knowledge.yaml").regions) == ["top", "front"]
    programs = save_programs(desk, "new", result, ("csv", "urscript"))
    names = zipfile.ZipFile(BytesIO(zipped(programs))).namelist()
    assert any(name.endswith(".csv") for name in names)
    assert all(name.startswith("programs/") for name in names)
    assert save_picture(desk, bench).read_bytes().startswith(b"\x89PNG")
    json.loads((place / "report.json").read_text())


def test_a_large_target_is_shown_thinned_and_painted_whole(bench):
    desk = bench.desk
    desk.add_target("large.ply", cloud(SIZE, 20_000, seed=2))
    body = desk.body("large")
    assert len(body.points) < len(body.cloud)
    mask = body.points[:, 1] > body.high[1] - 1e-6
    whole = body.to_all(mask)
    truth = body.cloud.points[:, 1] > body.high[1] - 1e-6
    assert (whole == truth).mean() > 0.98 and (body.to_shown(whole) == mask).all()
