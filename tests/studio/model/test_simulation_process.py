"""A simulation in a child process: run, written, cancelled and ended."""

from __future__ import annotations

import json
import threading
from importlib.util import find_spec

import pytest

from builders.studio_page import silent
from nrdf.errors import ProcessError, RobotError
from nrdf.studio.model import simulation_process
from nrdf.studio.model.simulation_process import SimulationProcess, require_mujoco
from nrdf.studio.model.studio_cell import StudioCell
from nrdf.studio.model.worker import Cancelled

# Not by importing it: nrdf must be first, to choose what MuJoCo draws with.
if find_spec("mujoco") is None:
    pytest.skip("pip install 'nrdf[robot]'", allow_module_level=True)


def test_a_simulation_in_its_own_process_is_driven_written_and_ended(
    plate_job,
    tmp_path,
    monkeypatch,
):
    monkeypatch.setenv("MUJOCO_GL", "off")  # pictures take long, and have tests of their own
    seen, phases = [], []
    running = SimulationProcess(plate_job, StudioCell())
    made = running.run(lambda done, total: seen.append(done / total), phases.append)
    assert made.report["total"]["waypoints"] == 27 and made.seconds > 5
    assert sorted(set(seen)) == sorted(set(seen), key=seen.index) and 0 < seen[-1] < 1
    assert any("top, sand: " in phase for phase in phases)
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
        SimulationProcess(tmp_path / "empty", StudioCell()).run(silent)


def test_cancelling_ends_the_process(plate_job):
    running = SimulationProcess(plate_job, StudioCell())

    def cancelled(done, total):
        raise Cancelled

    with pytest.raises(Cancelled):
        running.run(cancelled)
    outcomes, waits = [], threading.Event()

    def wait():
        with pytest.raises(Cancelled):
            running.run(lambda done, total: waits.set())
        outcomes.append("cancelled")

    waiting = threading.Thread(target=wait)
    waiting.start()
    assert waits.wait(10)
    running.end()
    waiting.join(10)
    assert not running._child._process.is_alive() and outcomes == ["cancelled"]


def test_without_mujoco_it_says_what_to_install(monkeypatch):
    monkeypatch.setattr(simulation_process, "find_spec", lambda name: None)
    with pytest.raises(RobotError, match=r"pip install 'nrdf\[robot\]'"):
        require_mujoco()
