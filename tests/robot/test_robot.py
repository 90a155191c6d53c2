"""The arm, its kinematics, its cell, and jobs driven on it."""

from __future__ import annotations

import json
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

# Not by importing it: nrdf must be first, to choose what MuJoCo draws with.
if find_spec("mujoco") is None:
    pytest.skip("pip install 'nrdf[robot]'", allow_module_level=True)

from builders.plate_job import write_job_on
from nrdf.errors import ProcessError, RobotError
from nrdf.geometry.canonical import rotation_about_up
from nrdf.geometry.similarity import Similarity, up_axis, upright
from nrdf.robot.model.arm import BUNDLED, load_arm
from nrdf.robot.model.cell import Cell, Placement, upright_rotation
from nrdf.robot.model.signed_distance import _without_specks, distance_field_from_points
from nrdf.robot.model.spheres import cover_box, cover_capsule, cover_cylinder
from nrdf.robot.model.tool import tool_of
from nrdf.robot.planning.inverse_kinematics import SeedLibrary, pose_errors, solve
from nrdf.robot.planning.timing import STEP_S, time_parameterize
from nrdf.toolpath.frames import surface_frames
from nrdf.toolpath.types import Segment, ToolPath

PLACE = Placement((0.8, 0.0, 0.4), np.pi, 0.4, (0.0,))


@pytest.fixture(scope="module")
def bowl():
    """A half sphere's shell, open upwards: y is up."""
    rng = np.random.default_rng(0)
    way = rng.normal(size=(3000, 3))
    way[:, 1] = -np.abs(way[:, 1])
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    points = np.concatenate([0.20 * way, 0.17 * way])
    return distance_field_from_points(points, np.concatenate([way, -way]))


def path_of(positions=((0.0, 0.2, 0.0), (0.05, 0.2, 0.0)), force=10.0):
    count = len(positions)
    down = np.tile([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)], (count, 1))
    segment = Segment("process", 0, np.array(positions), down, 0.1, force)
    return ToolPath("seat", "sand", "disc", 0.025, (segment,))


@pytest.fixture(scope="module")
def cell(arm, bowl):
    return Cell.build(arm, tool_of(path_of()), bowl, PLACE, upright_rotation(*np.eye(3)[[1, 0]]))


def test_the_bundled_arm_has_a_ur10es_reach_and_limits(arm):
    # Universal Robots' published parameters: stretched out along -x, the flange is there.
    tip = arm.chain.frames(np.zeros((1, 6))).tcp[0]
    np.testing.assert_allclose(tip, [-1.18425, -0.2907, 0.06085], atol=1e-4)
    np.testing.assert_allclose(
        np.degrees(arm.chain.speeds), [120, 120, 180, 180, 180, 180], atol=0.1
    )
    assert np.degrees(arm.chain.upper[2]) == pytest.approx(180, abs=0.1)


def test_the_jacobian_is_the_derivative_of_the_tip(cell):
    joints = np.random.default_rng(1).uniform(-2, 2, (5, 6))
    moved, _ = cell.chain.frames(joints).jacobian()
    step = 1e-6
    for j in range(6):
        there = cell.chain.frames(joints + step * np.eye(6)[j]).tcp
        slope = (there - cell.chain.frames(joints).tcp) / step
        np.testing.assert_allclose(moved[:, :, j], slope, atol=1e-5)


def test_inverse_kinematics_reach_what_the_arm_can_reach(cell):
    rng = np.random.default_rng(2)
    frames = cell.chain.frames(rng.uniform(-2, 2, (40, 6)))
    targets, axes = frames.tcp, frames.tool[:, :, 2]
    library = SeedLibrary.build(cell, 8000, rng)
    joints = library.nearest(targets, axes, 6).reshape(240, 6)
    joints, good = solve(cell.chain, joints, targets.repeat(6, axis=0), axes.repeat(6, axis=0))
    away, angle = pose_errors(
        cell.chain.frames(joints), targets.repeat(6, axis=0), axes.repeat(6, axis=0)
    )
    assert good.reshape(40, 6).any(axis=1).mean() > 0.9
    assert away[good].max() < 1e-4
    assert np.degrees(angle[good].max()) < 0.1


def test_a_target_out_of_reach_is_not_reached(cell):
    far = np.array([[3.0, 0.0, 0.0]])
    assert not solve(cell.chain, np.zeros((1, 6)), far, np.array([[0.0, 0.0, -1.0]]))[1].any()


@pytest.mark.parametrize(
    ("cover", "inside"),
    [
        (cover_capsule(np.zeros(3), np.array([0.0, 0.0, 0.3]), 0.05), lambda p: p),
        (cover_box(np.array([0.1, 0.05, 0.02])), None),
        (cover_cylinder(0.03, 0.005), None),
        (cover_cylinder(0.03, 0.05), None),
    ],
)
def test_spheres_enclose_the_shape(cover, inside):
    centres, radius = cover
    rng = np.random.default_rng(0)
    low, high = centres.min(0) - radius, centres.max(0) + radius
    points = rng.uniform(low, high, (20000, 3))
    shapes = {
        "capsule": lambda p: (
            np.linalg.norm(p - np.clip(p[:, 2:], 0, 0.3) * [0, 0, 1], axis=1) < 0.05
        ),
        "box": lambda p: (np.abs(p) < [0.1, 0.05, 0.02]).all(axis=1),
        "flat": lambda p: (np.hypot(p[:, 0], p[:, 1]) < 0.03) & (np.abs(p[:, 2]) < 0.005),
        "long": lambda p: (np.hypot(p[:, 0], p[:, 1]) < 0.03) & (np.abs(p[:, 2]) < 0.05),
    }
    name = {0.3: "capsule"}.get(round(float(np.ptp(centres[:, 2])), 3))
    name = name or ("box" if np.ptp(centres[:, 0]) > 0.1 else "flat" if radius < 0.01 else "long")
    points = points[shapes[name](points)]
    away = np.linalg.norm(points[:, None] - centres, axis=2).min(axis=1)
    assert (away <= radius + 1e-9).all()


def test_a_concave_object_is_not_swallowed_by_its_hull(bowl):
    middle, wall, below = np.array([[0.0, -0.05, 0.0], [0.0, -0.185, 0.0], [0.0, -0.225, 0.0]])
    away = bowl.distances(np.array([middle, wall, below]))[0]
    assert away[0] == pytest.approx(0.12, abs=0.012)
    assert away[1] < 0.0
    assert away[2] == pytest.approx(0.025, abs=0.004)


def test_timing_keeps_feed_and_limits(arm):
    joints = np.linspace([0.0] * 6, [0.4] * 6, 21)
    calm = time_parameterize(arm.chain, joints, np.full(20, 0.1))
    assert len(calm.joints) * STEP_S == pytest.approx(2.0, rel=0.2)
    assert (calm.feed_share == 1.0).all()
    hurried = time_parameterize(arm.chain, joints, np.full(20, 0.001))
    assert (np.abs(hurried.speeds) <= arm.chain.speeds * 1.001).all()
    assert (hurried.feed_share[:-1] < 1.0).all()
    np.testing.assert_allclose(hurried.speeds[[0, -1]], 0.0, atol=1e-6)


def test_the_force_sensor_feels_the_push_and_not_the_weight(cell):
    from nrdf.robot.simulation.scene import SimulatedArm

    still = np.array([0.0, -1.5, 1.5, -1.2, -1.57, 0.0])
    machine = SimulatedArm(cell, still)
    for push in (0.0, 20.0):
        for _ in range(300):
            tip, axis = machine.tip()
            machine.step(still, 0 * still, 0 * still, -push * axis, tip)
        assert machine.force(axis) == pytest.approx(push, abs=0.1)


def test_a_missing_robot_file():
    with pytest.raises(RobotError, match=r"no robot file nowhere\.urdf; give a URDF or MJCF file"):
        load_arm("nowhere.urdf")


def test_a_robot_file_that_does_not_load(tmp_path):
    file = tmp_path / "arm.xml"
    file.write_text("<mujoco><worldbody><body>")
    with pytest.raises(RobotError, match="does not load as URDF or MJCF"):
        load_arm(file)


def test_a_tool_frame_that_does_not_exist_lists_those_that_do():
    with pytest.raises(RobotError, match="no tool frame 'tcp'; known: flange, base, shoulder"):
        load_arm(BUNDLED, "tcp")


def test_an_arm_of_too_few_axes():
    with pytest.raises(RobotError, match=r"3 axes \(shoulder_pan, shoulder_lift, elbow\) lead to"):
        load_arm(BUNDLED, "forearm")


def test_a_urdf_keeps_its_speed_limits_and_says_which_meshes_are_missing(tmp_path):
    links = "".join(
        f'<link name="l{i}"><inertial><mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" '
        f'ixz="0" iyz="0"/></inertial><collision><origin xyz="0 0 .1"/><geometry>'
        + (
            '<mesh filename="package://x/y.stl"/>'
            if i == 3
            else '<cylinder radius=".03" length=".2"/>'
        )
        + "</geometry></collision></link>"
        for i in range(7)
    )
    joints = "".join(
        f'<joint name="j{i}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/>'
        f'<origin xyz="0 0 .2"/><axis xyz="{"0 0 1" if i % 2 else "0 1 0"}"/>'
        f'<limit lower="-2" upper="2" velocity="1.5" effort="50"/></joint>'
        for i in range(6)
    )
    file = tmp_path / "arm.urdf"
    file.write_text(f'<robot name="six">{links}{joints}</robot>')
    arm = load_arm(file)
    assert arm.joint_names == tuple(f"j{i}" for i in range(6))
    np.testing.assert_allclose(arm.chain.speeds, 1.5)
    assert any("1 meshes of arm.urdf are not there" in line for line in arm.warnings)


def test_a_folder_that_is_no_whole_job(tmp_path):
    from nrdf.robot.simulation.job import read_simulation_job
    from nrdf.toolpath.file import write_toolpaths
    from nrdf.toolpath.types import Job

    write_toolpaths(tmp_path, Job("chair", "target", (path_of(),)))
    with pytest.raises(ProcessError, match=r"has no knowledge\.yaml"):
        read_simulation_job(tmp_path)


@pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), (0.0, 0.005, 0.0), (0.0, -0.005, 0.0)])
def test_force_is_kept_on_an_object_that_is_5_mm_off(plate_job, arm, shift):
    from nrdf.robot.simulation.job import read_simulation_job
    from nrdf.robot.simulation.simulate import simulate

    place = Placement((0.75, 0.0, 0.3), np.pi, 0.0, (0.0,))
    done = simulate(read_simulation_job(plate_job), arm, placement=place, shift_m=shift)
    out = done.paths[0].metrics
    assert out.reached == out.waypoints == 27
    assert out.force_within is not None and out.force_within > 0.95
    assert out.achieved.worked == pytest.approx(out.planned.worked, abs=0.03)
    for found in (out.planned, out.executed, out.achieved):
        assert found.worked + sum(found.left_out.values()) + found.unreached == pytest.approx(1.0)
    # Three lines do not work the whole plate.
    assert out.achieved.unreached == pytest.approx(0.6, abs=0.03)
    assert not done.paths[0].collisions


def turned_job(plate_job, folder, pose):
    """The plate's job, its object and tool paths, in another frame."""
    import nrdf
    from nrdf.toolpath.file import read_toolpaths, write_toolpaths

    def turned(segment):
        held = Rotation.from_matrix(pose.rotation) * Rotation.from_quat(segment.quaternions_xyzw)
        positions = pose.to_scan(segment.positions)
        return replace(segment, positions=positions, quaternions_xyzw=held.as_quat())

    (folder / "knowledge.yaml").write_text((plate_job / "knowledge.yaml").read_text())
    cloud = nrdf.read_cloud(plate_job / "target.ply")
    normals = cloud.normals @ pose.rotation.T
    nrdf.write_cloud(
        folder / "target.ply", replace(cloud, points=pose.to_scan(cloud.points), normals=normals)
    )
    whole = read_toolpaths(plate_job)
    paths = tuple(replace(p, segments=tuple(map(turned, p.segments))) for p in whole.paths)
    write_toolpaths(folder, replace(whole, paths=paths, pose=pose))
    return folder


@pytest.mark.parametrize("up", ["z", "-x", "0.2 0.3 0.9"])
def test_a_job_stands_upright_in_the_cell_as_its_pose_says(plate_job, tmp_path, up):
    from nrdf.robot.simulation.job import read_simulation_job

    rotation = upright(up_axis(up)) @ rotation_about_up(0.4)
    pose = Similarity(rotation, np.array([2.0, -1.0, 5.0]), 1.0)
    work = read_simulation_job(turned_job(plate_job, tmp_path, pose))
    assert work.origin == "the object stands as the job's pose says" and not work.assumed
    distance_field = distance_field_from_points(work.points, work.normals)
    (there,) = Placement((0.75, 0.0, 0.3), np.pi, 0.1, (0.0,)).T_cell_object(
        distance_field, work.upright
    )
    np.testing.assert_allclose(there[:3, :3] @ rotation[:, 1], [0, 0, 1], atol=1e-9)
    np.testing.assert_allclose(there[:3, :3] @ rotation[:, 0], [1, 0, 0], atol=1e-9)
    points = work.points @ there[:3, :3].T + there[:3, 3]
    assert points[:, 2].min() == pytest.approx(0.1, abs=0.01)
    assert np.ptp(points[:, 2]) == pytest.approx(0.03, abs=1e-6)  # the plate lies flat
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    np.testing.assert_allclose(middle[:2], 0.0, atol=0.01)


def test_a_job_that_lies_is_driven_as_one_that_stands(plate_job, arm, tmp_path):
    from nrdf.robot.report.content import simulation_report
    from nrdf.robot.simulation.job import read_simulation_job
    from nrdf.robot.simulation.simulate import simulate

    pose = Similarity(upright(up_axis("z")), np.zeros(3), 1.0)
    place = Placement((0.75, 0.0, 0.3), np.pi, 0.0, (0.0,))
    report = simulation_report(
        simulate(read_simulation_job(turned_job(plate_job, tmp_path, pose)), arm, placement=place)
    )
    assert report["total"]["reached_share"] == 1.0
    assert report["placement"]["up"] == pytest.approx([0, 0, 1])
    assert not any("how its object lies" in line for line in report["warnings"])


def test_a_job_that_does_not_say_how_it_lies_is_taken_to_be_canonical_and_said_to_be(plate_job):
    from nrdf.robot.simulation.job import read_simulation_job

    work = read_simulation_job(plate_job)
    np.testing.assert_allclose(work.upright[[2, 0]], np.eye(3)[[1, 0]], atol=1e-12)
    assert work.assumed and "taken to have +Y up and +X ahead" in work.origin
    given = read_simulation_job(plate_job, "z")
    np.testing.assert_allclose(given.upright[[2, 0]], np.eye(3)[[2, 0]], atol=1e-12)
    assert not given.assumed and given.origin == "up is z, as given"


def test_each_path_has_the_strategy_that_made_it(plate_job, tmp_path):
    from nrdf.robot.simulation.job import read_simulation_job
    from nrdf.toolpath.file import read_toolpaths, write_toolpaths

    for name in ("target.ply", "knowledge.yaml"):
        (tmp_path / name).write_bytes((plate_job / name).read_bytes())
    whole = read_toolpaths(plate_job)
    (path,) = whole.paths
    other = replace(path, process="sand 2", strategy=replace(path.strategy, edge_margin_m=0.05))
    write_toolpaths(tmp_path, replace(whole, paths=(other, path)))
    assert [s.edge_margin_m for s in read_simulation_job(tmp_path).strategies] == [0.05, 0.0]
    # A job of an earlier nrdf: nothing tells how it was planned.
    write_toolpaths(tmp_path, replace(whole, paths=(replace(path, strategy=None),)))
    with pytest.raises(
        ProcessError, match=r"'sand' on 'top' has no strategy in its toolpaths\.json"
    ):
        read_simulation_job(tmp_path)
    write_toolpaths(tmp_path, replace(whole, paths=(replace(path, region="side"),)))
    with pytest.raises(ProcessError, match=r"'sand' on 'side': its knowledge\.yaml has no such"):
        read_simulation_job(tmp_path)


def test_force_is_kept_over_a_bend_that_few_waypoints_tell(arm, tmp_path):
    """Between waypoints 40 degrees apart the way is straight, 3 mm below a roller's skin."""
    from nrdf.robot.simulation.job import read_simulation_job
    from nrdf.robot.simulation.simulate import simulate

    rng = np.random.default_rng(0)
    turn, z = rng.uniform(0.0, 2.0 * np.pi, 6000), rng.uniform(-0.15, 0.15, 6000)
    out = np.stack([np.sin(turn), np.cos(turn), 0.0 * z], axis=1)
    points = 0.05 * out + np.stack([0.0 * z, np.full(6000, 0.4), z], axis=1)
    order = np.argsort(-out[:, 1])
    at = np.radians([-60.0, -20.0, 20.0, 60.0])
    outward = np.stack([np.sin(at), np.cos(at), 0.0 * at], axis=1)
    held = Rotation.from_matrix(surface_frames(np.cross(outward, [0.0, 0.0, -1.0]), outward))
    line = 0.05 * outward + [0.0, 0.4, 0.0]
    segments = [Segment("process", 0, line, held.as_quat(), 0.04, 10.0)]
    folder = write_job_on(tmp_path, points[order], out[order], 2000, segments)
    done = simulate(
        read_simulation_job(folder), arm, placement=Placement((0.75, 0, 0.3), np.pi, 0.3, (0.0,))
    )
    assert done.paths[0].metrics.reached == 4
    assert done.paths[0].metrics.force_within > 0.95


def test_single_nodes_on_the_wrong_side_are_no_part_of_a_solid():
    value = np.zeros((12, 12, 12))
    value[2:9, 2:9, 2:9] = 1.0
    wrong = value.copy()
    wrong[10, 10, 10], wrong[5, 5, 5] = 1.0, 0.0
    wrong[0, 0, :2] = 0.9
    np.testing.assert_array_equal(_without_specks(wrong), value)


def test_a_robot_that_reaches_nothing(plate_job, arm):
    from nrdf.robot.simulation.job import read_simulation_job
    from nrdf.robot.simulation.simulate import simulate

    place = Placement((4.0, 0.0, 0.3), np.pi, 0.0, (0.0,))
    with pytest.raises(
        RobotError, match=r"reaches none of the job's waypoints from its base at 4\.00"
    ):
        simulate(read_simulation_job(plate_job), arm, placement=place)


def test_a_job_in_another_unit_and_in_another_frame(plate_job, tmp_path):
    from shutil import copytree

    from nrdf.robot.simulation.job import read_simulation_job

    folder = tmp_path / "job"
    copytree(plate_job, folder)
    content = json.loads((folder / "toolpaths.json").read_text())
    for segment in content["paths"][0]["segments"]:
        segment["positions_m"] = [[1000 * x for x in p] for p in segment["positions_m"]]
    (folder / "toolpaths.json").write_text(json.dumps(content))
    with pytest.raises(ProcessError, match="the two are in different units or frames"):
        read_simulation_job(folder)
    content["frame"] = "cell"
    (folder / "toolpaths.json").write_text(json.dumps(content))
    with pytest.raises(
        ProcessError, match="tool paths are in the frame 'cell', its object in 'target'"
    ):
        read_simulation_job(folder)


def test_the_folder_of_a_simulation(plate_job, arm, tmp_path):
    from nrdf.robot.report.folder import write_simulation
    from nrdf.robot.simulation.job import read_simulation_job
    from nrdf.robot.simulation.simulate import simulate

    place = Placement((0.75, 0.0, 0.3), np.pi, 0.0, (0.0,))
    done = simulate(read_simulation_job(plate_job), arm, placement=place)
    report = write_simulation(tmp_path, done, "plate", {}, pictures=False)
    assert report["total"]["reached_share"] == 1.0
    assert report["paths"][0]["position_error_m"] < 1e-4
    head, *rows = (tmp_path / "joints.csv").read_text().splitlines()
    assert head.split(",")[6:12] == list(arm.joint_names)
    joints = np.array([[float(x) for x in row.split(",")[6:12]] for row in rows])
    assert np.abs(np.diff(joints, axis=0)).max() < 0.15  # no jumps
    assert "servoj(" in (tmp_path / "joints.script").read_text()
    page = (tmp_path / "report.html").read_text()
    assert "plate" in page
    said = "the job does not say how its object lies: taken to have +Y up and +X ahead"
    assert report["placement"]["object_pose"] == said and said in page
    assert any(said in line for line in report["warnings"])
    coverage = report["paths"][0]["coverage"]
    shares = coverage["achieved"], *coverage["left_out"].values(), coverage["unreached"]
    assert sum(shares) == pytest.approx(1.0)
