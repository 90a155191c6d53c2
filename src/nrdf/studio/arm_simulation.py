"""A target's job on a robot arm, in simulation: started, shown, played back and saved."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np
import viser

from nrdf.errors import RobotError
from nrdf.studio.context import StudioContext
from nrdf.studio.model.result_cache import TargetResult
from nrdf.studio.model.saving import save_job, saved_path, zipped
from nrdf.studio.model.simulation_process import SimulationProcess, require_mujoco
from nrdf.studio.model.worker import Progress, Worker
from nrdf.studio.scene.arm_view import ArmView
from nrdf.studio.scene.player import Player

if TYPE_CHECKING:
    from nrdf.studio.model.playback import Playback

SIMULATION = "sim"
_LATE_S = 1.5  # after the end, in which a click is for what was there before


class Status(Protocol):
    """Shows the progress of work in the background."""

    def started(self, what: str) -> None:
        """Work has begun."""

    def describe(self, what: str) -> None:
        """Another part of the work has begun."""

    def progress(self, done: int, total: int) -> None:
        """A share of the work is done."""


class ArmSimulation:
    """The last simulation: one target's job on the arm.

    It is that of the studio's cell.
    """

    worker: Worker
    """Simulates and saves in the background."""

    def __init__(self, context: StudioContext) -> None:
        self.context = context
        self.player = Player(self._advance)
        self.key, self.time_s, self.shown = "", 0.0, False
        self.saved_to: Path | None = None
        """The folder that the simulation was written to."""
        self.job = Path()
        """The job's folder."""
        self.on_time: Callable[[], None] = lambda: None
        """Called when the time has gone on."""
        self._ended_at = -np.inf
        self._arm_view: ArmView | None = None
        self._process: SimulationProcess | None = None
        self._result: TargetResult | None = None

    def connect(self, status: Status, ended: Callable[[str, str], None]) -> None:
        """Show the work on the page; `ended` is that of `Worker`."""
        self._status = status
        self.worker = Worker(status.started, status.progress, ended)

    @property
    def playback(self) -> Playback | None:
        """The simulation as it can be played, if there is one."""
        return None if self._arm_view is None else self._arm_view.playback

    @property
    def is_current(self) -> bool:
        """Whether the simulated job is the target's current one."""
        results = self.context.results
        return results.is_current(self.key) and results.by_target.get(self.key) is self._result

    # --- simulating

    def start(self, key: str) -> None:
        """Simulate a target's job, in the background.

        Raises RobotError where MuJoCo is missing, ProcessError where the target has no current
        result.
        """
        result = self.context.results.ready(key)
        require_mujoco()
        what = f"simulating the arm on {key}"

        def work(progress: Progress) -> None:
            progress(0, 1)
            job = save_job(self.context.editor, key, result, self.context.origin)
            process = SimulationProcess(job, self.context.cell)
            try:
                playback = process.run(
                    progress, lambda phase: self._status.describe(f"{what}: {phase}")
                )
                self._show_new(key, result, job, playback, process)
            except BaseException:
                process.end()
                raise

        self.worker.submit("simulate", what, work)

    def save(self, client: viser.ClientHandle) -> None:
        """Write the simulation as `nrdf simulate` does, in the background, and send it.

        Raises RobotError where there is no simulation of the target's current job.
        """
        process, key = self._process, self.key
        if process is None:
            raise RobotError("nothing is simulated yet: press 'Simulate on the arm' first")
        if not self.is_current:
            raise RobotError(
                f"the simulation is of before your last change to {key}: simulate again"
            )
        folder = saved_path(self.context.editor, key, SIMULATION)
        origin = {**self.context.origin, "job": str(self.job)}

        def work(progress: Progress) -> None:
            process.write(folder, key, origin, progress)
            client.send_file_download(f"{key}-sim.zip", zipped(folder), save_immediately=True)
            with self.context.lock:
                self.saved_to = folder
                self.context.refresh_panel()

        self.worker.submit("save", "drawing the film and writing the simulation", work)

    def clear(self) -> None:
        """Remove the arm and the simulation."""
        self.player.pause()
        if self._process is not None:
            self._process.end()
        if self._arm_view is not None:
            self._arm_view.remove()
        self._arm_view = self._process = self._result = self.saved_to = None
        self.key, self.shown = "", False

    def stop(self) -> None:
        """End everything that runs."""
        self.worker.stop()
        self.player.stop()
        if self._process is not None:
            self._process.end()

    def _show_new(
        self,
        key: str,
        result: TargetResult,
        job: Path,
        playback: Playback,
        process: SimulationProcess,
    ) -> None:
        context = self.context
        with context.lock, context.server.atomic():
            self.clear()
            object_view = context.scene.objects.get(key)
            if object_view is None:
                raise RobotError(f"{key} was removed while it was simulated")
            self._arm_view = ArmView(object_view, playback)
            self._process, self._result, self.job = process, result, job
            self.key, self.time_s, self.shown = key, 0.0, True
            context.arrange()
            context.refresh_panel()

    # --- playing

    def check_object(self) -> None:
        """Remove the simulation where its object was removed."""
        objects = self.context.scene.objects
        if self._arm_view is not None and objects.get(self.key) is not self._arm_view.object_view:
            self.clear()

    def follow_object(self) -> None:
        """Move the arm to its object, which has just been moved, and show or hide it."""
        if self._arm_view is not None:
            self._arm_view.set_visible(self.shown)
            if self.shown:
                self._arm_view.place(self._arm_view.object_view.offset)

    def show(self, shown: bool) -> None:
        """Show the arm with its object alone, or all objects without it.

        Raises RobotError where there is no arm to show.
        """
        if self._arm_view is None:
            raise RobotError("there is no arm to show yet: press 'Simulate on the arm' first")
        self.shown = shown
        if not shown:
            self.player.pause()
        self.context.arrange()

    def play_or_pause(self) -> None:
        """Pause where it plays, else play. Who presses Pause as the end comes wants no new
        beginning."""
        if self.player.playing:
            self.player.pause()
        elif time.monotonic() - self._ended_at > _LATE_S:
            self.play()

    def play(self) -> None:
        """Play from the shown moment, or from the beginning where that is the end."""
        if not self.shown:
            self.show(True)
        assert self._arm_view is not None  # else `show` raises
        if self.time_s >= self._arm_view.playback.seconds:
            self.seek(0.0)
        self.player.play()

    def seek(self, time_s: float) -> None:
        """Show a moment."""
        if self._arm_view is None:
            return
        self.time_s = time_s
        if self.shown:
            with self.context.server.atomic():
                self._arm_view.show(self._arm_view.playback.index_at(time_s))

    def _advance(self, seconds: float) -> bool:
        """Let time go on; whether there is more."""
        with self.context.lock:
            if self._arm_view is None:
                return False
            end = self._arm_view.playback.seconds
            self.seek(min(self.time_s + seconds, end))
            more = self.time_s < end
            if not more:
                self._ended_at = time.monotonic()
                self.player.pause()
            self.on_time()
            return more

    @property
    def occupied_points(self) -> np.ndarray | None:
        """Points (k, 3) in the scene that a camera has to see, if an arm is shown."""
        return None if self._arm_view is None or not self.shown else self._arm_view.occupied_points
