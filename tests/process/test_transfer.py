"""Transfer from a box to a box: an untrained field knows that one is the other."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

import nrdf
from builders.taught_box import SAND, SIZE, bound_knowledge, cloud, faces, solid
from nrdf.errors import CloudError, ModelError
from nrdf.geometry.canonical import canonical_transform
from nrdf.geometry.mesh import Mesh
from nrdf.geometry.similarity import Similarity
from nrdf.io.cloud import PointCloud, write_cloud
from nrdf.process.knowledge_file import write_knowledge
from nrdf.process.path_warnings import path_warnings
from nrdf.process.transfer import ProcessTransfer
from nrdf.process.warp import warp_segments

OFFSET = np.array([3.0, -1.0, 0.5])
OIL = {**SAND, "kind": "oil", "order": -1, "parameters": {"oil": "linseed"}}
TAUGHT = {
    **SAND, "name": "seam", "trajectory": "taught",
    "waypoints": [{"positions_m": [[0.25, 0.1, z] for z in np.linspace(-0.3, 0.3, 13).tolist()]}],
}  # fmt: skip


@pytest.fixture(scope="module")
def model(untrained):
    return nrdf.load_model(untrained)


@pytest.fixture(scope="module")
def transferred(model):
    taught = bound_knowledge({"top": [SAND, {**SAND, "transfer": "warp", "passes": 2}],
                     "right": [OIL], "front": [TAUGHT]}, solid())  # fmt: skip
    return ProcessTransfer(taught, model).transfer(solid(seed=1))


def test_an_object_in_any_pose_is_worked_as_one_in_the_canonical_orientation(model, transferred):
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7])
    target = solid(seed=1)
    mesh = Mesh(turn.apply(target.mesh.vertices) + OFFSET, target.mesh.faces)
    moved = PointCloud(
        turn.apply(target.points) + OFFSET, turn.apply(target.normals), unit="m", mesh=mesh
    )
    centre, scale = canonical_transform(target.points)
    pose = Similarity(turn.as_matrix(), turn.apply(centre) + OFFSET, scale)
    job = ProcessTransfer(transferred.bound_knowledge, model).transfer(model.encode(moved, pose))
    assert [step.reason for step in job.paths] == ["", "", "", ""]
    for step, turned in zip(transferred.paths, job.paths, strict=True):
        if step.transfer_mode != "warp":  # planning breaks ties of direction by the target's axes
            continue
        for segment, there in zip(process_segments(step), process_segments(turned), strict=True):
            np.testing.assert_allclose(
                turn.apply(segment.positions) + OFFSET, there.positions, atol=2e-3
            )
            apart = Rotation.from_quat(there.quaternions_xyzw).inv() * (
                turn * Rotation.from_quat(segment.quaternions_xyzw)
            )
            assert np.degrees(apart.magnitude().max()) < 3
    for step in job.paths:
        positions = np.concatenate([segment.positions for segment in process_segments(step)])
        back = np.abs(turn.inv().apply(positions - OFFSET))
        assert (np.abs(back - SIZE / 2).min(axis=1) < 0.01).all()


def test_a_target_may_be_a_file_or_an_array(model, tmp_path):
    process = ProcessTransfer(bound_knowledge({"top": [SAND]}), model)
    target = cloud(seed=1)
    write_cloud(tmp_path / "new.ply", target)
    from_file = process.transfer(tmp_path / "new.ply")
    np.testing.assert_array_equal(from_file.target.points, target.points)
    from_array = process.transfer(target.points, unit="m")
    np.testing.assert_array_equal(from_array.target.points, target.points)
    with pytest.raises(CloudError, match=r"the target cannot be dict.*accepted are"):
        process.transfer({})


def process_segments(step):
    return [segment for segment in step.path.segments if segment.kind == "process"]


def test_processes_come_in_their_order(transferred):
    steps = [(step.region, step.number, step.process.label) for step in transferred.paths]
    assert steps == [("right", 0, "oil"), ("top", 0, "sand"), ("top", 1, "sand 2"),
                     ("front", 0, "seam")]  # fmt: skip
    assert all(step.path is not None and not step.reason for step in transferred.paths)
    assert set(transferred.seconds) == {"regions", "surface", "tool paths"}


def test_regions_are_those_of_the_target(transferred):
    truth = faces(transferred.target)
    for name, region in transferred.regions.items():
        assert not region.missing
        common = np.intersect1d(region.match.indices, truth[name])
        assert len(common) > 0.9 * max(len(region.match.indices), len(truth[name]))


def test_a_strategy_is_planned_anew_on_the_target(transferred):
    step = transferred.paths[1]
    assert step.transfer_mode == "replan" and step.process.trajectory == "raster"
    positions = np.concatenate([segment.positions for segment in process_segments(step)])
    np.testing.assert_allclose(positions[:, 1], SIZE[1] / 2, atol=1e-9)
    assert step.metrics.coverage > 0.99 and len(process_segments(step)) == 1
    assert (step.path.process, step.path.tool_radius_m) == ("sand", 0.025)
    assert process_segments(step)[0].force_n == 10


def test_a_warped_strategy_has_the_references_lines(transferred):
    step = transferred.paths[2]
    assert step.transfer_mode == "warp" and step.process.trajectory == "taught"
    assert step.process.transfer is None and step.process.transfer_mode == "warp"
    once = len(step.process.waypoints)
    assert len(process_segments(step)) == 2 * once >= 2
    assert step.metrics.process_length_m > 2 * 0.8 * 0.5 * 0.9 / 0.04
    first = np.array(step.process.waypoints[0].positions_m)
    np.testing.assert_allclose(process_segments(step)[0].positions, first)


def test_taught_waypoints_are_warped_and_get_their_tools(transferred):
    step = transferred.paths[3]
    (segment,) = process_segments(step)
    given = np.array(TAUGHT["waypoints"][0]["positions_m"])
    np.testing.assert_allclose(segment.positions, given, atol=0.01)
    assert step.path.parameters == {} and step.path.process == "seam"
    kinds = [segment.kind for segment in step.path.segments]
    assert kinds == ["approach", "process", "retract"]


def test_free_parameters_go_along(transferred):
    assert transferred.paths[0].path.parameters == {"oil": "linseed"}


def test_a_direction_is_in_the_targets_frame(model):
    turned = bound_knowledge({"top": [{**SAND, "direction": [0, 0, 1]}]})
    step = ProcessTransfer(turned, model).transfer(cloud(seed=1)).paths[0]
    assert abs(step.process.direction[2]) > 0.99
    steps = np.concatenate([np.diff(s.positions, axis=0) for s in process_segments(step)])
    assert np.abs(steps[:, 2]).sum() > 5 * np.abs(steps[:, 0]).sum()


def test_a_region_that_is_not_there_is_skipped_never_invented(model):
    taught = ProcessTransfer(bound_knowledge({"top": [SAND, OIL], "right": [SAND]}), model)
    result = taught.transfer(cloud(seed=1), min_confidence=1.0)
    assert all(step.path is None and step.metrics is None for step in result.paths)
    assert ", below 1" in result.regions["top"].missing
    assert len(result.warnings) == 2
    assert result.warnings[0].startswith("region 'top' is skipped: confidence ")


def test_a_process_that_does_not_fit_the_target_is_left_out_with_the_reason(model):
    wide = {**SAND, "edge_margin_mm": 100}
    small = ProcessTransfer(bound_knowledge({"top": [wide, SAND]}), model).transfer(
        cloud(SIZE / 4, seed=1)
    )
    assert small.paths[0].path is None
    assert "edge_margin_m is 0.1" in small.paths[0].reason
    assert small.paths[1].path is not None


def test_waypoints_off_the_reference_are_named(model):
    far = {**TAUGHT, "waypoints": [{"positions_m": [[0.25, 0.1, 0.0], [0.45, 0.1, 0.0]]}]}
    step = (
        ProcessTransfer(bound_knowledge({"front": [far]}), model).transfer(cloud(seed=1)).paths[0]
    )
    assert "number 2 of line 1 is 200 mm" in step.reason and "standoff_m 0" in step.reason


def test_regions_that_overlap_on_the_target_are_said(model):
    reference = cloud()
    taught = bound_knowledge({"top": [SAND], "right": [SAND]}, reference, allow_overlap=True)
    both = np.union1d(taught.regions["right"], taught.regions["top"])
    changed = {**taught.regions, "right": both}
    taught = type(taught)(taught.knowledge, reference, changed)
    result = ProcessTransfer(taught, model).transfer(cloud(seed=1))
    assert any("regions 'top' and 'right' overlap" in line for line in result.warnings)


@pytest.mark.parametrize("transfer", ["replan", "warp"])
def test_contacts_lie_on_the_mesh_that_was_given(model, transfer):
    """Its points lie 5 mm outside of the box: planned on them, the tool would miss it."""
    box = trimesh.creation.box(SIZE - 2.0 * 5e-3)
    mesh = Mesh(np.array(box.vertices), np.array(box.faces))
    process = ProcessTransfer(bound_knowledge({"top": [{**SAND, "transfer": transfer}]}), model)
    result = process.transfer(replace(cloud(seed=1), mesh=mesh))
    (step,) = result.paths
    np.testing.assert_array_equal(result.surface.face_areas.sum(), box.area)
    assert step.metrics.surface_distance_99_m < 1e-9
    assert step.metrics.compared_with == "the mesh as given (12 triangles)"
    assert step.metrics.true_distance_95_m < 1e-6
    assert not [w for w in path_warnings(step.process, step.metrics) if "as given" in w]


def test_a_mesh_that_cannot_be_used_is_replaced_by_one_of_the_points_and_said(model):
    flat = Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]), np.array([[0, 1, 2]]))
    process = ProcessTransfer(bound_knowledge({"top": [SAND]}), model)
    result = process.transfer(replace(cloud(seed=1), mesh=flat))
    assert len(result.surface.faces) > 100
    assert any("the mesh as given is not used" in line for line in result.warnings)
    assert result.paths[0].metrics.coverage > 0.9


def test_paths_are_planned_on_all_points_of_a_cloud_that_is_thinned(model):
    """All points are 4 mm deeper on the top than those that a model works on."""
    target = cloud(seed=1)
    whole = cloud(count=20_000, seed=2)
    deeper = whole.points - [0.0, 0.004, 0.0] * (whole.normals[:, 1:2] > 0.5)
    process = ProcessTransfer(bound_knowledge({"top": [SAND]}), model)
    for normals in (whole.normals, None):
        (step,) = process.transfer(target, whole=PointCloud(deeper, normals)).paths
        assert step.metrics.compared_with == "all 20000 points as given"
        assert step.metrics.true_distance_95_m < 1.5e-3
        height = np.concatenate([s.positions for s in process_segments(step)])[:, 1]
        assert np.median(height) == pytest.approx(SIZE[1] / 2 - 0.004, abs=2e-4)
    (alone,) = process.transfer(target).paths
    assert alone.metrics.compared_with == f"all {len(target)} points as given"
    height = np.concatenate([s.positions for s in process_segments(alone)])[:, 1]
    assert np.median(height) == pytest.approx(SIZE[1] / 2, abs=2e-4)


def test_regions_have_meshes_with_what_was_changed(transferred):
    for region in transferred.regions.values():
        assert region.mesh.parent is transferred.surface
    assert transferred.regions["top"].mesh.area_m2 == pytest.approx(0.5 * 0.9, rel=0.1)


def test_a_region_smaller_than_its_tool_is_skipped_with_the_reason(model):
    large = {**SAND, "tool": {"radius_mm": 400}}
    result = ProcessTransfer(bound_knowledge({"top": [large]}), model).transfer(solid(seed=1))
    assert "smaller than the tool's footprint" in result.regions["top"].missing
    assert result.paths[0].path is None and result.paths[0].reason in result.warnings[0]


def test_a_warped_step_that_grew_is_reported(model, monkeypatch):
    def torn(correspondence, segments, radius):
        warped, lost = warp_segments(correspondence, segments, radius)
        first = warped[0]
        keep = np.r_[0:2, len(first.positions) - 1]
        parts = {n: getattr(first, n)[keep] for n in ("positions", "quaternions_xyzw", "normals")}
        return (replace(first, **parts), *warped[1:]), lost

    process = ProcessTransfer(bound_knowledge({"front": [TAUGHT]}), model)
    (step,) = process.transfer(cloud(seed=1)).paths
    assert not any("a step of" in warning for warning in step.warnings)
    monkeypatch.setattr("nrdf.process.target_paths.warp_segments", torn)
    (step,) = process.transfer(cloud(seed=1)).paths
    (warning,) = (w for w in step.warnings if "a step of" in w)
    assert re.match(
        r"a step of 5\d\d.* mm between .* the longest on the reference is 50 mm", warning
    )


def test_a_model_of_another_category_is_refused(model):
    table = bound_knowledge({"top": [SAND]}, category="table")
    with pytest.raises(ModelError, match="for the category chair, but the knowledge is about"):
        ProcessTransfer(table, model)


def test_normals_are_estimated_for_all_points_and_kept(model):
    whole = cloud(seed=1)
    result = ProcessTransfer(bound_knowledge({"top": [SAND]}), model).transfer(
        PointCloud(whole.points)
    )
    facing = np.einsum("na,na->n", result.target.normals, whole.normals)
    assert np.quantile(facing, 0.2) > 0.9
    assert result.paths[0].metrics.coverage > 0.9


def test_a_target_in_another_unit_is_brought_to_metres(model):
    there = solid(seed=1)
    mesh = Mesh(1000 * there.mesh.vertices + 5000, there.mesh.faces)
    far = PointCloud(1000 * there.points + 5000, there.normals, unit="mm", frame="cell", mesh=mesh)
    result = ProcessTransfer(bound_knowledge({"top": [SAND]}), model).transfer(far)
    assert (result.target.unit, result.target.frame) == ("m", "cell")
    positions = np.concatenate([s.positions for s in process_segments(result.paths[0])])
    np.testing.assert_allclose(positions[:, 1], 5 + SIZE[1] / 2, atol=1e-9)


def test_a_file_is_taught_and_a_folder_written(untrained, tmp_path):
    write_cloud(tmp_path / "box.ply", cloud())
    write_knowledge(tmp_path / "box.yaml", bound_knowledge({"top": [SAND]}).knowledge)
    process = nrdf.load_process(tmp_path / "box.yaml", nrdf.load_model(untrained))
    nrdf.write_job(tmp_path / "job", process.transfer(cloud(seed=1)))
    assert (tmp_path / "job" / "report.html").exists()
    assert process.bound_knowledge.knowledge.regions[0].name == "top"


def test_points_in_use_are_found_again(model):
    encoded = model.encode(cloud(count=20_000))
    some = np.arange(0, 20_000, 3)
    found = encoded.to_working(some)
    np.testing.assert_array_equal(encoded.working[found], np.intersect1d(encoded.working, some))


def test_taught_spots_are_warped_one_by_one(model):
    spots = [{"positions_m": [[0.25, 0.1, z]]} for z in (-0.2, 0.0, 0.2)]
    taught = bound_knowledge({"front": [{**TAUGHT, "waypoints": spots, "dwell_s": 2.0}]})
    step = ProcessTransfer(taught, model).transfer(cloud(seed=1)).paths[0]
    assert step.reason == "" and [len(s.positions) for s in process_segments(step)] == [1, 1, 1]
    assert step.metrics.cycle_time_s > 6.0
