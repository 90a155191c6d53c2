"""Step 6: a target's job on a robot arm, in simulation."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from nrdf.studio.arm_simulation import ArmSimulation
from nrdf.studio.context import StudioContext
from nrdf.studio.file_reading import read_cell
from nrdf.studio.model.cell_upload import CELL, ENDINGS
from nrdf.studio.model.studio_cell import StudioCell
from nrdf.studio.panels.inputs import Inputs
from nrdf.studio.panels.save import NO_TARGET, transferred_targets

_SPEEDS = ("1 ×", "2 ×", "5 ×", "10 ×", "30 ×")
_FIRST_SPEED = _SPEEDS[2]
_MEANINGS = {
    "limit": "outside the arm's reach or a joint's range",
    "singular": "at a singularity: two of the arm's axes line up",
    "collision": "the arm or the tool would collide, there or on every way there",
    "too fast": "the joints allow less than half of the feed",
}
_OBSTACLES = {
    "object": "the object",
    "floor": "the floor",
    "keep-out box": "a box",
    "itself": "the arm itself",
}
_MOTIONS = {
    "transition": "transition", "approach": "approach", "process": "process", "retract": "retract",
    "turntable": "turntable",
}  # fmt: skip


class RobotTab:
    """Simulate a target's job, read what the arm reaches, and play it back."""

    def __init__(self, context: StudioContext, inputs: Inputs, simulation: ArmSimulation) -> None:
        self.context, self.inputs, self.simulation = context, inputs, simulation
        gui = context.server.gui
        gui.add_markdown(
            "Simulate the job on a robot arm: what it reaches, where it would collide, and the "
            "contact force."
        )
        self.cell = gui.add_markdown("")
        self.upload = gui.add_upload_button(
            "Cell file …", mime_type=",".join(ENDINGS), color="gray",
            hint="A cell file, or a ZIP of it with the robot's URDF or MJCF and its meshes.",
        )  # fmt: skip
        self.without = gui.add_button("Without the cell file", color="gray", visible=False)
        self.target = gui.add_dropdown("Target", (NO_TARGET,))
        self.simulate = gui.add_button("Simulate on the arm", color="green")
        self.play = gui.add_button("Play", disabled=True)
        self.time = gui.add_slider("Time, s", 0.0, 1.0, 0.1, 0.0, disabled=True)
        self.speed = gui.add_dropdown("Playback speed", _SPEEDS, initial_value=_FIRST_SPEED)
        self.now = gui.add_markdown("")
        self.shown = gui.add_checkbox(
            "Show the arm", False, hint="With its object alone; otherwise all objects, no arm."
        )
        self.save = gui.add_button("Save the simulation")
        self.saved = gui.add_markdown("")
        self.status = gui.add_markdown("")
        inputs.on(self.upload.on_upload, lambda event: self._load(event.value))
        inputs.on(self.without.on_click, lambda _: self._take(StudioCell()))
        inputs.on(self.simulate.on_click, lambda _: simulation.start(self.target.value))
        inputs.on(self.play.on_click, lambda _: self._play())
        inputs.on(self.time.on_update, lambda event: self._seek(float(event.value)))
        inputs.on(self.speed.on_update, lambda event: self._set_speed(event.value))
        inputs.on(self.shown.on_update, lambda event: self._show(event.value))
        inputs.on(self.save.on_click, lambda event: simulation.save(event.client))
        simulation.on_time = self.refresh_time

    def refresh(self) -> None:
        """Show the targets, and the simulation."""
        simulation, cell = self.simulation, self.context.cell
        self.cell.content = f"Simulations and programs are for {cell.words}."
        self.without.visible = cell.described is not None
        self.inputs.set_options(self.target, transferred_targets(self.context))
        playback = simulation.playback
        self.play.disabled = self.time.disabled = self.save.disabled = playback is None
        self.inputs.set_value(self.shown, simulation.shown)
        folder = simulation.saved_to
        self.saved.content = (
            "" if folder is None
            else f"Written to `{folder}`, as `nrdf simulate {simulation.job} --out …` does."
        )  # fmt: skip
        if playback is None:
            self.status.content = ""
        else:
            self.time.max = max(round(playback.seconds, 1), 0.1)
            outdated = "" if simulation.is_current else " *(of before your last change)*"
            self.status.content = f"**{simulation.key}**{outdated}: {summary(playback.report)}"
        self.refresh_time()

    def refresh_time(self) -> None:
        """Show the moment of the playback."""
        simulation, playback = self.simulation, self.simulation.playback
        label = "Pause" if simulation.player.playing else "Play"
        if self.play.label != label:
            self.play.label = label
        if playback is None:
            self.now.content = ""
            return
        self.inputs.set_value(self.time, round(min(simulation.time_s, self.time.max), 1))
        index = playback.index_at(simulation.time_s)
        path, motion = playback.report["paths"][playback.path[index]], str(playback.motion[index])
        words = [f"{path['region']}, {path['process']}", _MOTIONS[motion]]
        if playback.line[index] >= 0:
            words.append(f"line {playback.line[index]}")
        if motion == "process" and path["force"] is not None:
            words.append(f"{playback.force_n[index]:.1f} N of {path['force']['commanded_n']:g} N")
        text = " · ".join(words)
        if self.now.content != text:
            self.now.content = text

    def _load(self, file: Any) -> None:
        read_cell(self.context, file, self._take)

    def _take(self, cell: StudioCell) -> None:
        """Another cell: what was simulated in the one before is put away."""
        if cell.described is None:
            shutil.rmtree(self.context.editor.session.folder / CELL, ignore_errors=True)
        given = self.context.cell  # an arm of the command line is that without a cell file
        self.context.cell = replace(cell, robot=given.robot, tool_frame=given.tool_frame)
        self.simulation.clear()
        self.context.arrange()
        self.refresh()

    def _play(self) -> None:
        self.simulation.player.speed = _factor(self.speed.value)
        self.simulation.play_or_pause()
        self.refresh()

    def _seek(self, time_s: float) -> None:
        self.simulation.seek(time_s)
        self.refresh_time()

    def _set_speed(self, shown: str) -> None:
        self.simulation.player.speed = _factor(shown)

    def _show(self, shown: bool) -> None:
        try:
            self.simulation.show(shown)
        finally:
            self.refresh()


def summary(report: Mapping[str, Any]) -> str:
    """The result of a simulation, in Markdown: the total, each region, what is not reached and why.

    report: the content of the simulation's report.json.
    """
    total = report["total"]
    minutes, seconds = divmod(round(total["time_s"]), 60)
    head = [
        f"**{total['reached_share']:.1%}** of {total['waypoints']} waypoints reached",
        f"**{total['collisions'] or 'no'}** moves with a collision",
    ]
    if total["force_within"] is not None:
        head.append(f"force within ±20 % for **{total['force_within']:.1%}** of the contact")
    head.append(f"**{minutes} min {seconds} s**")
    rows = ["| region | process | reached | force | time |", "|---|---|---|---|---|"]
    notes, verdicts = [], []
    for path in report["paths"]:
        force = path["force"]
        pressed = "–" if force is None else f"{force['mean_n']:.1f} ± {force['spread_n']:.1f} N"
        reached = path["reached"] / path["waypoints"]
        rows.append(
            f"| {path['region']} | {path['process']} | {reached:.1%} | {pressed} | "
            f"{path['time_s']:.0f} s |"
        )
        counts = {k: n for k, n in path["verdicts"].items() if n and k != "reached"}
        verdicts += [verdict for verdict in counts if verdict not in verdicts]
        if counts:
            listed = ", ".join(f"{n} {verdict}" for verdict, n in counts.items())
            notes.append(f"⚠ **{path['region']}**, not reached: {listed}.")
        if path["collisions"]:
            notes.append(f"⚠ **{path['region']}**: {_collisions(path['collisions'])}")
    if verdicts:
        meanings = "; ".join(f"*{verdict}*: {_MEANINGS[verdict]}" for verdict in verdicts)
        notes.append(f"Red points on the object are not reached. {meanings}.")
    return "\n".join([", ".join(head) + ".", "", *rows, "", *(f"{note}  " for note in notes)])


def _collisions(collisions: list[Mapping[str, Any]]) -> str:
    worst = max(collisions, key=lambda c: c["depth_m"])
    moves = "1 move collides" if len(collisions) == 1 else f"{len(collisions)} moves collide"
    depth = 1e3 * worst["depth_m"]
    return f"{moves}, with {_OBSTACLES[worst['what']]} by up to {depth:.1f} mm: do not run it so."


def _factor(shown: str) -> float:
    return float(shown.split()[0])
