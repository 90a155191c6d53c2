"""The arm in the studio: driven in a process of its own, as it is shown, played, told and ended."""

from __future__ import annotations

import json
import threading
from importlib.util import find_spec

import numpy as np
import pytest

# Not by importing it: nrdf must be first, to choose what MuJoCo draws with.
if find_spec("mujoco") is None:
    pytest.skip("pip install 'nrdf[robot]'", allow_module_level=True)

from scipy.spatial.transform import Rotation

from nrdf.errors import ProcessError, RobotError
from nrdf.robot.model.cell import Placement
from nrdf.robot.simulation.job import read_simulation_job
from nrdf.robot.simulation.simulate import simulate
from nrdf.studio.model import simulation_process
from nrdf.studio.model.playback import EVERY_PATH, FLOOR, playback_of
from nrdf.studio.model.simulation_process import SimulationProcess, require_mujoco
from nrdf.studio.model.worker import Cancelled
from nrdf.studio.scene.player import Player

TOP_M = 0.42  # height of the plate that the job is on


def silent(done, total):
    """Progress that nobody looks at."""


@pytest.fixture(scope="module")
def playback(plate_job, arm):
    # Turned at first, so that the object's turn counts.
    place = Placement((0.75, 0.1, 0.3), np.pi + 0.1, 0.2, (0.4,))
    return playback_of(simulate(read_simulation_job(plate_job), arm, placement=place))


def test_the_pad_is_on_the_object_while_it_works(playback):
    orange = [s for s in playback.shapes if s.path == 0 and s.colour[0] > 2 * s.colour[2]]
    (pad,) = orange
    at_work = np.flatnonzero(playback.motion == "process")[20::25]
    for at in at_work:
        turn = Rotation.from_quat(np.roll(playback.quaternions_wxyz[at, pad.body], -1))
        placed = turn.apply(pad.vertices) + playback.positions[at, pad.body]
        about = Rotation.from_euler("z", playback.turntable_rad[at]).as_matrix()
        R, t = about @ playback.T_cell_object[:3, :3], about @ playback.T_cell_object[:3, 3]
        on_object = (placed - t) @ R
        assert on_object[:, 1].min() == pytest.approx(TOP_M, abs=0.006)
        assert np.abs(on_object[:, [0, 2]]).max() < 0.15
    assert len(at_work) > 3 and playback.turntable_rad[at_work[0]] == pytest.approx(0.4)


def test_what_a_playback_holds(playback):
    assert playback.times[0] == 0.0 and (np.diff(playback.times) > 0).all()
    count = len(playback.times)
    assert playback.positions.shape[0] == len(playback.motion) == len(playback.force_n) == count
    assert playback.index_at(-1.0) == 0 and playback.index_at(1e9) == count - 1
    assert playback.times[playback.index_at(3.0)] == pytest.approx(3.0, abs=0.05)
    assert len(playback.unreached) == 0 and playback.report["total"]["reached_share"] == 1.0
    bodies = {shape.body for shape in playback.shapes if shape.path == EVERY_PATH}
    assert FLOOR in bodies and len(bodies) == 8, "six links, the base, and what they stand on"
    lowest = min(s.vertices[:, 2].min() for s in playback.shapes if s.body == FLOOR)
    assert lowest == pytest.approx(0.0), "the floor"


@pytest.fixture
def stage(plate_job):
    """A stage with the plate that the job is on; without a browser."""
    pytest.importorskip("viser", reason="pip install 'nrdf[studio]'")
    from nrdf.studio.scene.scene_view import SceneView
    from nrdf.studio.serving import open_server

    server = open_server("127.0.0.1", 8465)
    made = SceneView(server)
    made.clear(2.5)
    yield made
    server.stop()


def test_on_the_stage_the_pad_is_on_the_object_too(playback, stage, plate_job):
    from nrdf.studio.model.paintable_cloud import PaintableCloud
    from nrdf.studio.scene.arm_view import ArmView

    plate = PaintableCloud(read_simulation_job(plate_job).bound_knowledge.cloud)
    object_view = stage.add("plate", plate)
    stage.arrange(["plate"])
    stood = object_view.offset
    arm_view = ArmView(object_view, playback)
    pad = next(s for s in playback.shapes if s.path == 0 and s.colour[0] > 2 * s.colour[2])
    frames = {handle.name: handle for handle in (arm_view._root, *arm_view._bodies.values())}

    def placed(name, points):
        frame = frames[name]
        turn = Rotation.from_quat(np.roll(frame.wxyz, -1))
        return turn.apply(points) + frame.position

    for at in np.flatnonzero(playback.motion == "process")[20::40]:
        arm_view.show(int(at))
        scene = placed("/arm", placed(f"/arm/body{pad.body}", pad.vertices * stage.units_per_m))
        down = np.array([0.0, -1.0, 0.0])
        met = stage.hit(scene.mean(axis=0) - down, down)
        assert met is not None, "the object is below the pad, turned as the turntable is"
        turned = Rotation.from_quat(np.roll(object_view.frame.wxyz, -1))
        assert turned.magnitude() == pytest.approx(playback.turntable_rad[at])
        point = turned.apply(plate.points[met[1]] * stage.units_per_m) + object_view.frame.position
        assert scene[:, 1].min() == pytest.approx(point[1], abs=0.006 * stage.units_per_m)
    seen = arm_view.occupied_points
    assert len(seen) and seen[:, 1].min() < 0.0, "the column's foot is below the raised object"
    arm_view.remove()
    np.testing.assert_allclose(object_view.offset, stood, atol=1e-12)
    assert object_view.frame.wxyz[0] == pytest.approx(1.0)


def test_a_simulation_in_its_own_process_is_driven_written_and_ended(
    plate_job,
    tmp_path,
    monkeypatch,
):
    monkeypatch.setenv("MUJOCO_GL", "off")  # pictures take long, and have tests of their own
    seen, said = [], []
    running = SimulationProcess(plate_job)
    made = running.run(lambda done, total: seen.append(done / total), said.append)
    assert made.report["total"]["waypoints"] == 27 and made.seconds > 5
    assert sorted(set(seen)) == sorted(set(seen), key=seen.index) and 0 < seen[-1] < 1
    assert any("top, sand: " in phase for phase in said)
    report = running.write(tmp_path / "sim", "plate", {"command": "nrdf studio"}, silent)
    assert json.loads((tmp_path / "sim" / "report.json").read_text())["title"] == "plate"
    assert {"joints.csv", "report.html"} <= set(report["files"])
    assert [path.name for path in tmp_path.iterdir()] == ["sim"]
    running._child._process.kill()
    with pytest.raises(RobotError, match="ended by itself"):
        running.write(tmp_path / "sim", "plate", {}, silent)
    running.end()


def test_what_the_command_line_refuses_is_refused_alike(tmp_path):
    with pytest.raises(ProcessError, match="empty"):
        SimulationProcess(tmp_path / "empty").run(silent)


def test_cancelling_ends_the_process(plate_job):
    running = SimulationProcess(plate_job)

    def cancelled(done, total):
        raise Cancelled

    with pytest.raises(Cancelled):
        running.run(cancelled)
    told, waits = [], threading.Event()

    def wait():
        with pytest.raises(Cancelled):
            running.run(lambda done, total: waits.set())
        told.append("cancelled")

    waiting = threading.Thread(target=wait)
    waiting.start()
    assert waits.wait(10)
    running.end()
    waiting.join(10)
    assert not running._child._process.is_alive() and told == ["cancelled"]


def test_without_mujoco_it_says_what_to_install(monkeypatch):
    monkeypatch.setattr(simulation_process, "find_spec", lambda name: None)
    with pytest.raises(RobotError, match=r"pip install 'nrdf\[robot\]'"):
        require_mujoco()


def test_a_player_plays_pauses_and_ends_by_itself():
    times, enough, ended = [], threading.Event(), threading.Event()

    def advance(seconds):
        times.append(seconds)
        enough.set()
        if len(times) > 3:
            ended.set()
        return len(times) <= 3

    player = Player(advance)
    player.speed = 10.0
    player.play()
    assert enough.wait(5) and ended.wait(5)
    while player.playing:
        threading.Event().wait(0.01)
    count = len(times)
    assert min(times) > 0.3, "ten times as fast"
    player.play()
    player.pause()
    threading.Event().wait(0.15)
    assert len(times) <= count + 1 and not player.playing
    player.stop()


def test_verdicts_are_told_in_words(playback):
    pytest.importorskip("viser", reason="pip install 'nrdf[studio]'")
    from nrdf.studio.panels.robot import summary

    report = json.loads(json.dumps(playback.report, default=float))
    assert "**100.0%** of 27 waypoints reached, **no** moves with a collision" in summary(report)
    assert "Red points" not in summary(report)
    (path,) = report["paths"]
    path["verdicts"] |= {"reached": 20, "singular": 3, "too fast": 4}
    path["collisions"] = [{"what": "floor", "depth_m": 0.0123}]
    said = summary(report)
    assert "⚠ **top**, not reached: 3 singular, 4 too fast." in said
    assert "*singular*: at a singularity" in said and "*limit*" not in said
    assert "⚠ **top**: 1 move collides, with the floor by up to 12.3 mm" in said
