"""A simulation in a child process, which keeps the result, to draw and write it on request."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib.util import find_spec
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nrdf.errors import RobotError
from nrdf.studio.model.child_process import ChildProcess, answer, progress_of
from nrdf.studio.model.studio_cell import StudioCell
from nrdf.studio.model.worker import Progress

if TYPE_CHECKING:
    from nrdf.studio.model.playback import Playback


def require_mujoco() -> None:
    """Raises RobotError, which says what to install, where MuJoCo is missing."""
    if find_spec("mujoco") is None:
        raise RobotError(
            "simulating needs MuJoCo, which is not installed: pip install 'nrdf[robot]' (Python "
            "3.11 or newer), then start the studio again"
        )


class SimulationProcess:
    """A process that simulates one job in a cell."""

    def __init__(self, job: Path, cell: StudioCell) -> None:
        self._child = ChildProcess(_serve, (job, cell), _ended_error)

    def run(self, progress: Progress, say: Callable[[str], None] = lambda what: None) -> Playback:
        """Wait for the simulation; `say` gets the phases of the work. Raises RobotError and
        ProcessError as `nrdf simulate` does, and what `progress` raises."""
        made: Playback = self._child.wait(progress, say)
        return made

    def write(
        self, folder: Path, title: str, origin: Mapping[str, Any], progress: Progress
    ) -> dict[str, Any]:
        """Write what `nrdf simulate` writes, whole or not at all; the content of its report.json.

        Raises OutputError, and what `progress` raises."""
        made: dict[str, Any] = self._child.request((folder, title, dict(origin)), progress)
        return made

    def end(self) -> None:
        """End the process; half-written files are removed. Who waits for it gets Cancelled."""
        self._child.end()


def _ended_error(why: str) -> RobotError:
    return RobotError(
        f"the simulation's process has ended by itself ({why}), perhaps for lack of memory: "
        "simulate again, or use `nrdf simulate`"
    )


def _serve(pipe: Connection, job: Path, cell: StudioCell) -> None:
    """In the child process: simulate, then write on request until the studio has ended."""
    simulated: list[Any] = []
    answer(pipe, lambda: _simulate(pipe, job, cell, simulated))
    while simulated:
        request = pipe.recv()
        if request is not None:  # else cancelled after it was written
            answer(pipe, lambda request=request: _write(pipe, simulated[0], *request))  # type: ignore[misc]


def _simulate(pipe: Connection, job: Path, cell: StudioCell, kept: list[Any]) -> Playback:
    from nrdf.robot.model.arm import load_arm
    from nrdf.robot.simulation.described_cell import simulate_in_cell
    from nrdf.robot.simulation.job import read_simulation_job
    from nrdf.robot.simulation.simulate import simulate
    from nrdf.studio.model.playback import playback_of

    work = read_simulation_job(job)
    seen: list[str] = []

    def phase(what: str) -> None:
        # The phases of one tool path begin alike.
        seen.append(what.partition(":")[0])
        pipe.send(("phase", what))
        pipe.send(("progress", (len(set(seen)) - 1, 2 + len(work.job.paths))))

    if cell.described is None:
        simulated = simulate(work, load_arm(cell.robot, cell.tool_frame), progress=phase)
    else:
        simulated = simulate_in_cell(cell.described, cell.folder, work, phase)
    kept.append(simulated)
    return playback_of(simulated)


def _write(
    pipe: Connection, simulated: Any, place: Path, title: str, origin: Mapping[str, Any]
) -> dict[str, Any]:
    from nrdf.io.output import output_folder
    from nrdf.robot.report.folder import write_simulation

    with output_folder(place, overwrite=True) as folder:
        return write_simulation(folder, simulated, title, origin, progress=progress_of(pipe))
