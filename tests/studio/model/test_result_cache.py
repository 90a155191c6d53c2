"""Plans on the reference and transfers to targets, kept as long as they are current."""

from __future__ import annotations

import numpy as np
import pytest

import nrdf
from builders.studio_page import silent
from builders.taught_box import cloud, faces
from nrdf.errors import ProcessError, RegionError
from nrdf.process.transfer import ProcessTransfer
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.model.teaching import bound_knowledge_of
from nrdf.studio.model.worker import Cancelled
from nrdf.studio.scene.drawing import title_of


def test_plans_hold_as_long_as_what_they_are_of(results):
    editor = results.editor
    results.make_plans(editor.document, silent)
    top, front = editor.document.regions
    plan = results.plan(top, 0)
    assert not plan.fault and plan.checked.metrics.coverage > 0.9 and plan.lines
    editor.change_numbers("top", 0, {"stepover_mm": 20.0})
    editor.recolour_region("front", (1, 2, 3))
    top, front = editor.document.regions
    assert results.plan(top, 0) is None and results.plan(front, 0) is not None
    results.make_plans(editor.document, silent)
    assert results.plan(editor.document.regions[0], 0).checked.process.stepover_m == 0.02


def test_a_first_look_is_near_the_plan_and_shown_until_that_is_there(results):
    editor = results.editor
    results.make_plans(editor.document, silent)
    mesh = results.shown_mesh(editor.document.regions[0])
    editor.change_numbers("top", 0, {"stepover_mm": 20.0})
    document = editor.document
    top, front = document.regions
    assert results.shown_plan(top, 0) is None
    results.look(document, "top", 0, silent)
    look = results.shown_plan(top, 0)
    assert results.plan(top, 0) is None and look.region is None and look.left is None
    assert results.shown_mesh(top) is mesh and len(results.planned_lines(top)) == len(look.lines)
    editor.change_numbers("top", 0, {"stepover_mm": 21.0})
    assert results.shown_plan(editor.document.regions[0], 0) is look, "until the next one"
    editor.change_numbers("top", 0, {"stepover_mm": 20.0})
    results.make_plans(editor.document, silent)
    plan = results.shown_plan(editor.document.regions[0], 0)
    assert plan is not look and plan.region is not None
    one, other = look.checked.metrics, plan.checked.metrics
    assert one.coverage == pytest.approx(other.coverage, abs=0.02)
    assert one.process_length_m == pytest.approx(other.process_length_m, rel=0.05)
    assert one.cycle_time_s == pytest.approx(other.cycle_time_s, rel=0.1)
    assert one.true_distance_95_m is None and other.true_distance_95_m is not None
    editor.paint(REFERENCE, "top", front.mask)
    top = editor.document.regions[0]
    assert results.shown_plan(top, 0) is None and results.shown_mesh(top) is None


def test_a_plan_that_is_refused_is_named_by_field_and_value(results):
    results.editor.change_numbers("top", 0, {"feed_mm_s": 0.0})
    results.editor.change_numbers("front", 0, {"edge_margin_mm": 900.0})
    results.make_plans(results.editor.document, silent)
    top, front = results.editor.document.regions
    assert "region 'top', process 1 (sand), feed_m_s" in results.plan(top, 0).fault
    assert "edge_margin_m is 0.9, which leaves nothing" in results.plan(front, 0).fault


def test_planning_can_be_cancelled_and_keeps_what_is_done(results):
    def until_second(done, total):
        if done == 1:
            raise Cancelled

    with pytest.raises(Cancelled):
        results.make_plans(results.editor.document, until_second)
    top, front = results.editor.document.regions
    assert results.plan(top, 0) is not None and results.plan(front, 0) is None


def test_a_transfer_holds_until_the_processes_change(results):
    editor, seen = results.editor, []
    results.transfer(editor.document, lambda done, total: seen.append((done, total)))
    assert results.is_current("new") and seen[-1][0] > seen[0][0]
    paths = results.by_target["new"].transfer_result.paths
    assert [path.region for path in paths] == ["top", "front"]
    first = results.by_target["new"]
    editor.recolour_region("top", (9, 9, 9))
    assert results.is_current("new"), "colours do not count"
    results.transfer(editor.document, silent)
    assert results.by_target["new"] is first
    editor.change_numbers("top", 0, {"stepover_mm": 20.0})
    assert not results.is_current("new")
    results.transfer(editor.document, silent)
    assert results.is_current("new")


def test_a_region_painted_on_the_target_is_taken_as_it_is(results):
    editor = results.editor
    results.transfer(editor.document, silent)
    body = editor.paintable("new")
    mask = np.zeros(len(body.cloud), bool)
    mask[faces(body.cloud)["top"]] = True
    editor.paint("new", "top", mask)
    assert not results.is_current("new")
    results.transfer(editor.document, silent)
    top = results.by_target["new"].transfer_result.regions["top"]
    assert top.match.method == "marked" and top.match.score == 1.0
    np.testing.assert_array_equal(top.match.indices, np.flatnonzero(mask))
    editor.paint("new", "top", np.zeros_like(mask))
    results.transfer(editor.document, silent)
    assert results.by_target["new"].transfer_result.regions["top"].missing == "marked as not there"
    assert "top" in results.by_target["new"].uncertain_regions
    assert "check" in title_of(editor, results, "new")


def test_a_marked_region_must_be_taught_and_on_the_target(results, untrained):
    bound_knowledge = bound_knowledge_of(results.editor.session.clouds, results.editor.document)
    process_transfer, target = (
        ProcessTransfer(bound_knowledge, nrdf.load_model(untrained)),
        cloud(seed=1),
    )
    with pytest.raises(RegionError, match="no taught region 'lid'; known: top, front"):
        process_transfer.transfer(target, marked={"lid": [1, 2]})
    with pytest.raises(RegionError, match=r"region 'top' on the target: .*are not on"):
        process_transfer.transfer(target, marked={"top": [[9.0, 9.0, 9.0]]})


def test_an_incomplete_document_is_refused(results):
    results.editor.change_numbers("top", 0, {"feed_mm_s": -1.0})
    with pytest.raises(ProcessError, match=r"region 'top', process 1 \(sand\), feed_m_s"):
        results.transfer(results.editor.document, silent)


def test_similarity_is_greatest_around_the_point_itself(results):
    document = results.editor.document
    described = results.correspondence_features(document, silent)
    away = described.distances(17)[REFERENCE]
    # An untrained C finds each of a shape's points on the same shape again.
    assert away.argmin() == 17 and away[17] == pytest.approx(0, abs=1e-5)
    assert described.distances(18)[REFERENCE].argmin() == 18, "for another point at once"
    assert list(described.objects) == [REFERENCE]
    results.transfer(document, silent)
    found = results.correspondence_features(document, silent)
    assert found.distances(17)["new"].shape == (len(results.editor.paintable("new").points),)
    assert found.objects[REFERENCE] is described.objects[REFERENCE], "computed once"


def test_scans_get_the_surface_that_is_planned_on_once(results, monkeypatch):
    editor = results.editor
    assert results.surface(REFERENCE) is None
    results.make_surfaces(editor.document, silent)
    meshes = [results.surface(key) for key in (REFERENCE, "new")]
    assert all(len(mesh.faces) > 500 for mesh in meshes)
    low, high = meshes[1].vertices.min(axis=0), meshes[1].vertices.max(axis=0)
    cloud = editor.target("new").object.cloud.points
    np.testing.assert_allclose(high - low, np.ptp(cloud, axis=0), rtol=0.05)
    monkeypatch.setattr(results._computing, "call", None)
    results.make_surfaces(editor.document, silent)
    editor.remove_target("new")
    results.make_surfaces(editor.document, silent)
    assert results.surface(REFERENCE) is meshes[0] and len(results._surfaces) == 1
