"""Step 6: the process on a robot arm, in simulation."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nrdf.studio.panels.save import NO_TARGET

if TYPE_CHECKING:
    from nrdf.studio.panels.panel import Panel

_SPEEDS = ("1 ×", "2 ×", "5 ×", "10 ×", "30 ×")
_FIRST_SPEED = _SPEEDS[2]
_MEANS = {
    "limit": "beyond the arm's reach or a joint's range",
    "singular": "two of the arm's axes line up there",
    "collision": "arm or tool would touch something, there or on every way there",
    "too fast": "the joints allow less than half of the speed asked for",
}
_TOUCHED = {"object": "the object", "floor": "the floor", "itself": "the arm itself"}
_DOING = {
    "transition": "on its way", "approach": "coming down", "process": "at work",
    "retract": "lifting", "turntable": "the object turns",
}  # fmt: skip


class ArmTab:
    """Simulate a target's job, read what the arm reaches, and play it back."""

    def __init__(self, panel: Panel) -> None:
        self.panel, self.studio = panel, panel.studio
        gui = self.studio.server.gui
        gui.add_markdown(
            "See before anything moves what a robot arm reaches, what it would hit, and how hard "
            "it presses."
        )
        self.target = gui.add_dropdown("Target", (NO_TARGET,))
        self.simulate = gui.add_button("Simulate on the arm", color="green")
        self.play = gui.add_button("Play", disabled=True)
        self.time = gui.add_slider("Time, s", 0.0, 1.0, 0.1, 0.0, disabled=True)
        self.speed = gui.add_dropdown("Speed", _SPEEDS, initial_value=_FIRST_SPEED)
        self.now = gui.add_markdown("")
        self.shown = gui.add_checkbox(
            "Show the arm", False, hint="With its object alone; else all objects, without the arm."
        )
        self.save = gui.add_button("Save the simulation")
        self.place = gui.add_markdown("")
        self.status = gui.add_markdown("")
        panel.on(
            self.simulate.on_click, lambda _: self.studio.arm_simulation.start(self.target.value)
        )
        panel.on(self.play.on_click, lambda _: self._play())
        panel.on(self.time.on_update, lambda said: self._seek(float(said.value)))
        panel.on(self.speed.on_update, lambda said: self._speed(said.value))
        panel.on(self.shown.on_update, lambda said: self._show(said.value))
        panel.on(self.save.on_click, lambda said: self.studio.arm_simulation.save(said.client))

    def refresh(self) -> None:
        """The targets, and what was simulated."""
        simulation = self.studio.arm_simulation
        keys = [
            key
            for key in self.studio.editor.object_keys()[1:]
            if key in self.studio.results.by_target
        ]
        self.panel.set_options(self.target, tuple(keys) or (NO_TARGET,))
        playback = simulation.playback
        self.play.disabled = self.time.disabled = self.save.disabled = playback is None
        self.panel.set_value(self.shown, simulation.shown)
        if playback is None:
            self.status.content = self.place.content = ""
        else:
            self.time.max = max(round(playback.seconds, 1), 0.1)
            old = "" if simulation.is_current else " *(of before your last change)*"
            self.status.content = f"**{simulation.key}**{old}: {verdicts(playback.report)}"
        self.played()

    def played(self) -> None:
        """Where the playing is."""
        simulation, playback = self.studio.arm_simulation, self.studio.arm_simulation.playback
        label = "Pause" if simulation.player.playing else "Play"
        if self.play.label != label:
            self.play.label = label
        if playback is None:
            self.now.content = ""
            return
        self.panel.set_value(self.time, round(min(simulation.time_s, self.time.max), 1))
        at = playback.at(simulation.time_s)
        path = playback.report["paths"][playback.path[at]]
        words = [f"{path['region']}, {path['process']}", _DOING[str(playback.doing[at])]]
        if playback.line[at] >= 0:
            words.append(f"line {playback.line[at]}")
        if playback.doing[at] == "process" and path["force"] is not None:
            words.append(f"{playback.force_n[at]:.1f} N of {path['force']['commanded_n']:g} N")
        said = " · ".join(words)
        if self.now.content != said:
            self.now.content = said

    def saved(self, place: Path, job: Path) -> None:
        """Where a simulation was written to."""
        self.place.content = f"Written to `{place}`, as `nrdf simulate {job} --out …` does."

    def _play(self) -> None:
        simulation = self.studio.arm_simulation
        if simulation.player.playing:
            simulation.player.pause()
        else:
            simulation.player.speed = _factor(self.speed.value)
            simulation.play()
        self.refresh()

    def _seek(self, time_s: float) -> None:
        self.studio.arm_simulation.seek(time_s)
        self.played()

    def _speed(self, shown: str) -> None:
        self.studio.arm_simulation.player.speed = _factor(shown)

    def _show(self, shown: bool) -> None:
        try:
            self.studio.arm_simulation.show(shown)
        finally:
            self.refresh()


def verdicts(report: Mapping[str, Any]) -> str:
    """What came of a simulation, in Markdown: the whole, each region, what is missed and why."""
    total = report["total"]
    minutes, seconds = divmod(round(total["time_s"]), 60)
    said = [
        f"**{total['reached_share']:.1%}** of {total['waypoints']} waypoints reached",
        f"**{total['collisions'] or 'no'}** moves with a collision",
    ]
    if total["force_within"] is not None:
        said.append(f"force within ±20 % for **{total['force_within']:.1%}** of the contact")
    said.append(f"**{minutes} min {seconds} s**")
    rows = ["| region | process | reached | force | time |", "|---|---|---|---|---|"]
    missed, kinds = [], []
    for path in report["paths"]:
        force = path["force"]
        pressed = "–" if force is None else f"{force['mean_n']:.1f} ± {force['spread_n']:.1f} N"
        reached = path["reached"] / path["waypoints"]
        rows.append(
            f"| {path['region']} | {path['process']} | {reached:.1%} | {pressed} | "
            f"{path['time_s']:.0f} s |"
        )
        counts = {k: n for k, n in path["verdicts"].items() if n and k != "reached"}
        kinds += [kind for kind in counts if kind not in kinds]
        if counts:
            listed = ", ".join(f"{n} {kind}" for kind, n in counts.items())
            missed.append(f"⚠ **{path['region']}**, not reached: {listed}.")
        if path["collisions"]:
            worst = max(path["collisions"], key=lambda c: c["depth_m"])
            count = len(path["collisions"])
            moves = "1 move touches" if count == 1 else f"{count} moves touch"
            missed.append(
                f"⚠ **{path['region']}**: {moves} something, {_TOUCHED[worst['what']]} by up to "
                f"{1e3 * worst['depth_m']:.1f} mm: do not run it so."
            )
    if kinds:
        means = "; ".join(f"*{kind}*: {_MEANS[kind]}" for kind in kinds)
        missed.append(f"Red points on the object are not reached. {means}.")
    return "\n".join([", ".join(said) + ".", "", *rows, "", *(f"{line}  " for line in missed)])


def _factor(shown: str) -> float:
    return float(shown.split()[0])
