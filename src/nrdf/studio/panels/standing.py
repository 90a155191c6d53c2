"""Step 4: how a target stands, and what of its scan it is, proposed and corrected."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from nrdf.errors import NrdfError
from nrdf.studio.context import StudioContext
from nrdf.studio.file_reading import clean_again
from nrdf.studio.model.document import LoadedObject, Target
from nrdf.studio.model.placing import (
    AS_IN_FILE,
    CLEANED,
    TURNS,
    PlacedScan,
    Placement,
    turned,
    with_rotation_of,
)
from nrdf.studio.panels.inputs import Inputs, PanelEvent

BY_HAND = "turned by hand"
_LABELS = {"floor": "Without the floor", "outliers": "Without stray points",
           "objects": "Without other objects"}  # fmt: skip


class StandingFolder:
    """Asks how a target stands until a person has confirmed it."""

    def __init__(self, context: StudioContext, inputs: Inputs) -> None:
        self.context, self.inputs = context, inputs
        gui = context.server.gui
        self.folder = gui.add_folder("How does it stand?", visible=False)
        with self.folder:
            self.status = gui.add_markdown("")
            self.target = gui.add_dropdown("Scan", ("",), visible=False)
            self.right = gui.add_button("It stands like this", color="green")
            self.pose = gui.add_dropdown(
                "Pose", (AS_IN_FILE,), hint="The likely ones, with their probabilities."
            )
            self.turn = [
                gui.add_button_group("Turn it", TURNS[:4]),
                gui.add_button_group("Tip it", TURNS[4:]),
            ]
            self.number = gui.add_dropdown("Object", ("1 of 1",), visible=False)
            self.steps = {
                name: gui.add_checkbox(_LABELS[name], True, visible=False) for name in CLEANED
            }
        inputs.on(self.target.on_update, lambda event: self._show(event.value))
        inputs.on(self.right.on_click, lambda _: self._confirm())
        inputs.on(self.pose.on_update, lambda event: self._choose(event.value))
        for group in self.turn:
            inputs.on(group.on_click, lambda event: self._turn(event.value))
        inputs.on(self.number.on_update, lambda event: self._take(event.value))
        for name, box in self.steps.items():
            inputs.on(box.on_update, partial(self._clean, name))
        self._key = ""

    def refresh(self) -> None:
        """Show the scan that is asked about, the first one that nobody has confirmed."""
        inputs = self.inputs
        waiting = unconfirmed(self.context)
        visible = bool(waiting)
        if self.folder.visible != visible:
            self.folder.visible = visible
        if not waiting:
            return
        self._key = self._key if self._key in waiting else waiting[0]
        inputs.set_options(self.target, tuple(waiting))
        inputs.set_value(self.target, self._key)
        self.target.visible = len(waiting) > 1
        loaded, placement = self._asked()
        self.status.content = about(self._key, loaded, placement)
        options = pose_options(placement)
        inputs.set_options(self.pose, options)
        inputs.set_value(self.pose, options[chosen_pose(placement)])
        numbers = tuple(f"{i + 1} of {placement.count}" for i in range(placement.count))
        inputs.set_options(self.number, numbers)
        inputs.set_value(self.number, numbers[min(placement.number, len(numbers) - 1)])
        self.number.visible = placement.count > 1
        removed = {step.name: step.removed for step in placement.steps}
        for name, box in self.steps.items():
            inputs.set_value(box, name not in placement.skipped)
            box.visible = name in placement.skipped or removed.get(name, 0) > 0

    def _asked(self) -> tuple[LoadedObject, Placement]:
        target = self.context.editor.target(self._key)
        if target is None or target.object.placement is None:
            raise NrdfError("that scan is gone: add it again")
        return target.object, target.object.placement

    def _show(self, key: str) -> None:
        self._key = key
        self.refresh()

    def _set(self, placement: Placement) -> None:
        self.context.editor.place_target(self._key, placement)
        self.context.sync()

    def _confirm(self) -> None:
        self._set(replace(self._asked()[1], confirmed=True))

    def _choose(self, option: str) -> None:
        _, placement = self._asked()
        number = pose_options(placement).index(option)
        if number < len(placement.poses):
            self._set(replace(placement, pose=placement.poses[number]))

    def _turn(self, which: str) -> None:
        loaded, placement = self._asked()
        self._set(turned(placement, loaded.cloud.points, which))

    def _take(self, option: str) -> None:
        _, placement = self._asked()
        self._again(placement.skipped, int(option.partition(" ")[0]) - 1)

    def _clean(self, name: str, event: PanelEvent) -> None:
        _, placement = self._asked()
        left = tuple(n for n in placement.skipped if n != name)
        self._again(left if event.value else (*left, name), placement.number)

    def _again(self, skipped: tuple[str, ...], number: int) -> None:
        key, (loaded, earlier) = self._key, self._asked()
        scan = loaded.cloud if loaded.scan is None else loaded.scan.cloud

        def cleaned(placed: PlacedScan) -> None:
            placement = placed.placement
            if number == earlier.number:
                placement = with_rotation_of(placement, earlier, placed.cloud.points)
            if self.context.editor.target(key) is not None:
                self.context.editor.replace_target(key, replace(placed, placement=placement))
                self.context.sync()

        clean_again(self.context, scan, skipped, number, cleaned)


def unconfirmed(context: StudioContext) -> list[str]:
    """The targets of which nobody has said yet that they stand as they are shown."""

    def waits(target: Target) -> bool:
        return target.object.placement is not None and not target.object.placement.confirmed

    return [target.object.name for target in context.editor.document.targets if waits(target)]


def pose_options(placement: Placement) -> tuple[str, ...]:
    """The poses that can be chosen, in words, and the one turned by hand, if there is one."""
    options = [f"{i + 1}: {pose.words}" for i, pose in enumerate(placement.poses)]
    return (*options, BY_HAND) if chosen_pose(placement) == len(options) else tuple(options)


def chosen_pose(placement: Placement) -> int:
    """The number of the chosen pose among `pose_options`."""
    same = [i for i, pose in enumerate(placement.poses) if pose is placement.pose]
    return same[0] if same else len(placement.poses)


def about(key: str, loaded: LoadedObject, placement: Placement) -> str:
    """What was proposed and removed, in Markdown."""
    words = placement.pose.words
    sure = f"with a probability of {words}" if words != AS_IN_FILE else ""
    if words == AS_IN_FILE:
        by_hand = chosen_pose(placement) == len(placement.poses)
        sure = BY_HAND if by_hand else AS_IN_FILE
    lines = [f"**{key}** stands as it is shown, its front along the arrow ({sure}). Is that right?"]
    removed = [f"{s.name} {s.removed}" for s in placement.steps if s.removed and s.name != "thin"]
    if removed:
        lines.append(
            f"{len(loaded.cloud)} points kept; removed, shown in red: {', '.join(removed)}."
        )
    lines += [f"⚠ {warning}" for warning in placement.warnings]
    return "  \n".join(lines)
