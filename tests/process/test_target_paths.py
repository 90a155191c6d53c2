"""Processes on a target that is the reference itself, and one a little larger."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import nrdf
from builders.taught_box import SAND, SIZE, bound_knowledge, faces, solid
from nrdf.geometry.mesh import Mesh
from nrdf.geometry.similarity import Similarity
from nrdf.process.transfer import ProcessTransfer


@pytest.fixture(scope="module")
def model(untrained):
    return nrdf.load_model(untrained)


def on_larger(model, processes):
    told = []
    transfer = ProcessTransfer(bound_knowledge({"top": processes}, solid()), model)
    result = transfer.transfer(solid(1.2 * SIZE), progress=lambda *now: told.append(now))
    return result, told


def test_planned_and_warped_paths_lie_on_the_targets_mesh(model):
    result, told = on_larger(model, [SAND, {**SAND, "transfer": "warp"}])
    assert told == [(1, 3), (2, 3)]
    for step in result.paths:
        work = [s for s in step.path.segments if s.kind == "process"]
        np.testing.assert_allclose(
            np.concatenate([s.positions for s in work])[:, 1], 0.36, atol=1e-6
        )
        assert step.metrics.true_distance_worst_m < 1e-6
        assert step.metrics.coverage > 0.9
    planned, warped = (step.metrics.line_spacing_mean_m for step in result.paths)
    assert planned == pytest.approx(0.04, rel=0.1)
    assert warped == pytest.approx(1.2 * planned, rel=0.1)  # the reference's lines, stretched


def test_a_path_that_cannot_be_planned_has_a_reason_and_does_not_stop_the_others(model):
    result, _ = on_larger(model, [{**SAND, "edge_margin_mm": 900}, SAND])
    wrong, right = result.paths
    assert "edge_margin_m is 0.9" in wrong.reason and wrong.path is None
    assert right.reason == "" and right.path is not None


TURNED = Rotation.from_rotvec([0.0, 0.5, 0.0])


def heading(step):
    (line, *_) = [s for s in step.path.segments if s.kind == "process"]
    ahead = line.positions[1] - line.positions[0]
    return ahead / np.linalg.norm(ahead)


def test_a_fixed_direction_turns_with_the_object_only_and_a_taught_one_with_the_region(model):
    # The target's top is three times as long: what is taught as a diagonal becomes a flatter one.
    wide = SIZE * [1.0, 1.0, 3.0]
    lines = {"direction": [1, 0, 1], "line_order": "one-way"}
    modes = [{**SAND, **lines, "direction_mode": mode} for mode in ("fixed", "taught")]
    transfer = ProcessTransfer(bound_knowledge({"top": modes}, solid()), model)
    encoded = model.encode(solid(wide))
    upright, turned = (
        transfer.transfer(e, marked={"top": faces(solid(wide))["top"]}).paths
        for e in (encoded, turned_cloud(model, solid(wide)))
    )
    diagonal = np.array([1.0, 0.0, 1.0]) / np.sqrt(2.0)
    np.testing.assert_allclose(upright[0].process.direction, diagonal, atol=1e-9)
    assert abs(heading(upright[0]) @ diagonal) > 0.999
    flatter = np.array(upright[1].process.direction)
    assert flatter @ diagonal < 0.99
    np.testing.assert_allclose(turned[0].process.direction, TURNED.apply(diagonal), atol=1e-6)


def turned_cloud(model, given):
    """The same box, turned in its cloud's frame, encoded upright."""
    own = model.encode(given)
    pose = Similarity(TURNED.as_matrix(), np.zeros(3), 1.0)
    cloud = replace(
        given, points=TURNED.apply(given.points), normals=TURNED.apply(given.normals),
        mesh=Mesh(TURNED.apply(given.mesh.vertices), given.mesh.faces),
    )  # fmt: skip
    return replace(own, cloud=cloud, pose=own.pose.then(pose))


def test_the_origin_moves_with_the_region_or_with_the_whole_object(model):
    along = {"direction": [0, 0, 1], "line_order": "snake", "edge_margin_mm": 5}
    taught = {**SAND, **along, "origin_m": [0.1, 0.3, 0.2]}
    fixed = {**taught, "origin_m": [0.06, 9.0, 0.0], "origin_mode": "fixed"}
    result, _ = on_larger(model, [taught, fixed])
    x = float(result.paths[0].process.origin_m[0])
    assert x == pytest.approx(0.12, abs=0.02)
    assert result.paths[1].process.origin_m[0] == pytest.approx(1.2 * 0.06, abs=2e-3)
    for step in result.paths:
        origin = step.process.origin_m[0]
        places = np.concatenate([s.positions for s in step.path.segments if s.kind == "process"])
        on_top = places[np.abs(places[:, 0]) < 0.25]
        off = (on_top[:, 0] - origin) / 0.04
        assert np.abs(off - off.round()).max() < 0.03


def test_a_taught_origin_lies_on_the_reference(model):
    result, _ = on_larger(model, [{**SAND, "direction": [0, 0, 1], "origin_m": [0.1, 0.6, 0.2]}])
    assert "origin_m is 300 mm from the reference" in result.paths[0].reason
    assert "origin_mode: fixed" in result.paths[0].reason
