"""The process on a robot arm, in simulation: started, shown, played back and saved."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from nrdf.errors import RobotError
from nrdf.studio.model.result_cache import TargetResult
from nrdf.studio.model.saving import place_of, save_job, zipped
from nrdf.studio.model.simulation_process import SimulationProcess, require_mujoco
from nrdf.studio.model.worker import Progress, Worker
from nrdf.studio.scene.arm_view import ArmView
from nrdf.studio.scene.player import Player

if TYPE_CHECKING:
    import numpy as np
    import viser

    from nrdf.studio.app import Studio
    from nrdf.studio.model.playback import Playback

SIMULATION = "sim"


class ArmSimulation:
    """One target's job on the arm: that of the last simulation.

    robot, tool_frame: of `nrdf.robot.model.arm.load_arm`, the bundled arm unless given.
    """

    def __init__(self, studio: Studio, robot: Path | None, tool_frame: str | None) -> None:
        self.studio, self._robot, self._tool_frame = studio, robot, tool_frame
        activity = studio.panel.driving
        self.worker = Worker(activity.started, activity.progress, studio.ended(activity))
        self.player = Player(self._advance)
        self.key, self.time_s, self.shown = "", 0.0, False
        self._arm_view: ArmView | None = None
        self._process: SimulationProcess | None = None
        self._result: TargetResult | None = None
        self._job = Path()

    @property
    def playback(self) -> Playback | None:
        """What there is to play."""
        return None if self._arm_view is None else self._arm_view.playback

    @property
    def is_current(self) -> bool:
        """Whether what was simulated is what is on the target now."""
        results = self.studio.results
        return results.is_current(self.key) and results.by_target.get(self.key) is self._result

    # --- simulating

    def start(self, key: str) -> None:
        """Simulate a target's job, in the background.

        Raises RobotError where the simulation's engine is missing, ProcessError where the target
        has no current result.
        """
        result = self.studio.results.ready(key)
        require_mujoco()
        what = f"simulating the arm on {key}"

        def say(phase: str) -> None:
            self.studio.panel.driving.says(f"{what}: {phase}")

        def work(progress: Progress) -> None:
            progress(0, 1)
            job = save_job(self.studio.editor, key, result, self.studio.origin)
            process = SimulationProcess(job, self._robot, self._tool_frame)
            try:
                playback = process.drive(progress, say)
                self._put(key, result, job, playback, process)
            except BaseException:
                process.end()
                raise

        self.worker.submit("simulate", what, work)

    def save(self, client: viser.ClientHandle) -> None:
        """Write the simulation as `nrdf simulate` does, in the background, and send it.

        Raises RobotError where there is none of what is on the target now.
        """
        process, key = self._process, self.key
        if process is None:
            raise RobotError("nothing is simulated yet: press 'Simulate on the arm' first")
        if not self.is_current:
            raise RobotError(
                f"the simulation is of before your last change to {key}: simulate again"
            )
        place = place_of(self.studio.editor, key, SIMULATION)
        origin = {**self.studio.origin, "job": str(self._job)}

        def work(progress: Progress) -> None:
            process.write(place, key, origin, progress)
            client.send_file_download(f"{key}-sim.zip", zipped(place), save_immediately=True)
            with self.studio.lock:
                self.studio.panel.arm.saved(place, self._job)

        self.worker.submit("save", "drawing the film and writing the simulation", work)

    def clear(self) -> None:
        """Put the arm away, and forget the simulation."""
        self.player.pause()
        if self._process is not None:
            self._process.end()
        if self._arm_view is not None:
            self._arm_view.remove()
        self._arm_view = self._process = self._result = None
        self.key, self.shown = "", False

    def stop(self) -> None:
        """End everything that runs."""
        self.worker.stop()
        self.player.stop()
        if self._process is not None:
            self._process.end()

    def _put(
        self,
        key: str,
        result: TargetResult,
        job: Path,
        playback: Playback,
        process: SimulationProcess,
    ) -> None:
        studio = self.studio
        with studio.lock, studio.server.atomic():
            self.clear()
            object_view = studio.scene.objects.get(key)
            if object_view is None:
                raise RobotError(f"{key} is not there any more")
            self._arm_view = ArmView(object_view, playback)
            self._process, self._result, self._job = process, result, job
            self.key, self.time_s, self.shown = key, 0.0, True
            studio.arrange()
            studio.panel.refresh()

    # --- playing

    def check(self) -> None:
        """Go where the object has gone."""
        object_views = self.studio.scene.objects
        if (
            self._arm_view is not None
            and object_views.get(self.key) is not self._arm_view.object_view
        ):
            self.clear()

    def follow(self) -> None:
        """Stand with the object, which has just been put somewhere, if the arm is to be seen."""
        if self._arm_view is not None:
            self._arm_view.see(self.shown)
            if self.shown:
                self._arm_view.stand(self._arm_view.object_view.offset)

    def show(self, shown: bool) -> None:
        """Show the arm with its object alone, or all objects without it.

        Raises RobotError where there is no arm to show.
        """
        if self._arm_view is None:
            raise RobotError("there is no arm to show yet: press 'Simulate on the arm' first")
        self.shown = shown
        if not shown:
            self.player.pause()
        self.studio.arrange()

    def play(self) -> None:
        """Play from where it is, or from the beginning where it is at its end."""
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
            with self.studio.server.atomic():
                self._arm_view.show(self._arm_view.playback.at(time_s))

    def _advance(self, seconds: float) -> bool:
        """Let time go on; whether there is more."""
        with self.studio.lock:
            if self._arm_view is None:
                return False
            end = self._arm_view.playback.seconds
            self.seek(min(self.time_s + seconds, end))
            more = self.time_s < end
            if not more:
                self.player.pause()
            self.studio.panel.arm.played()
            return more

    @property
    def places(self) -> np.ndarray | None:
        """Places (k, 3) in the scene that a camera has to see, if an arm is shown."""
        return None if self._arm_view is None or not self.shown else self._arm_view.places
