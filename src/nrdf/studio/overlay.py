"""What lies over the objects in the browser: tools, legends, thumbnails, time line, and the cursor.

`page/overlay.js` draws it. What to draw stands in an element of the panel; what a person does there
comes as a request.
"""

from __future__ import annotations

import html
import json
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import viser

from nrdf.studio.arm_simulation import ArmSimulation
from nrdf.studio.context import StudioContext
from nrdf.studio.mouse import Mouse, camera_of
from nrdf.studio.scene.colours import hexadecimal, legend_of
from nrdf.studio.scene.drawing import title_of
from nrdf.studio.serving import StudioServer
from nrdf.studio.thumbnails import Thumbnails
from nrdf.studio.tools import ACTS, ERASE, TOOLS

if TYPE_CHECKING:
    from nrdf.studio.panels.inputs import Inputs

_MOST_CORNERS, _MOST_PARTS = 400, 200
_STATE = '<div data-nrdf-state="{}" hidden></div>'
_CLIENT = '<div data-nrdf-client="{}" hidden></div>'


class Takes(Protocol):
    """Takes tools."""

    def take(self, name: str) -> None:
        """Take a tool, or do one of the acts."""


class Overlay:
    """panel: what buttons and keys do."""

    def __init__(
        self, context: StudioContext, mouse: Mouse, simulation: ArmSimulation, inputs: Inputs,
        panel: Takes,
    ) -> None:  # fmt: skip
        self.context, self.mouse, self._inputs, self._panel = context, mouse, inputs, panel
        self._simulation, self.thumbnails = simulation, Thumbnails(self._drawn)
        self._state = context.server.gui.add_html("")
        context.server.on_client_connect(self._welcome)
        context.server.on_client_disconnect(self._left)
        if isinstance(context.server, StudioServer):
            context.server.may_change = context.pen.may_change
            context.server.page.answers |= {
                "tool": self._act, "act": self._act, "hover": self._hover, "lasso": self._lasso,
                "only_look": self._look_only, "take_pen": self._take_pen,
                "target": self._show_target, "seek": self._seek,
                "thumbnail": lambda values: self.thumbnails.png(values["name"]),
            }  # fmt: skip

    def refresh(self) -> None:
        """Show what the studio has now."""
        text = _STATE.format(html.escape(json.dumps(self.content()), quote=True))
        if self._state.content != text:
            self._state.content = text

    def content(self) -> dict[str, Any]:
        """What is shown, as `page/overlay.js` takes it."""
        context = self.context
        return {
            "pen": context.pen.holder,
            "tool": self.mouse.tool,
            "tools": [[each.name, each.key, _plain(each.hint)] for each in TOOLS],
            "erase": self.mouse.erase,
            "erase_key": ERASE.key,
            "acts": [[each.name, each.key, each.hint] for each in ACTS],
            "legend": legend_of(context.colouring, context.editor.document.regions),
            "targets": self._targets(),
            "line": self._line(),
        }

    def _targets(self) -> list[tuple[str, str, str, bool]]:
        """Name, words, stamp of the picture, and whether it alone is shown: the most doubtful
        first; [] for a single target."""
        context = self.context
        keys = context.editor.object_keys()[1:]
        if len(keys) < 2:
            return []
        found = context.results.by_target
        colours = {region.name: region.colour for region in context.editor.document.regions}

        def doubt(key: str) -> tuple[int, float]:
            if key not in found:
                return 1, 0.0
            regions = found[key].transfer_result.regions.values()
            least = min((0.0 if r.missing else r.match.score for r in regions), default=1.0)
            return (0 if found[key].uncertain_regions else 2), least

        return [
            (key, title_of(context.editor, context.results, key),
             self.thumbnails.stamp(key, found.get(key), colours), key == context.shown_target)
            for key in sorted(keys, key=doubt)
        ]  # fmt: skip

    def _line(self) -> list[tuple[float, float, str, str, bool]]:
        """The simulation's time line, a part for each tool path: when it begins, how long it is,
        its colour, what is said of it, and whether waypoints were not reached; [] without one."""
        playback = self._simulation.playback
        if playback is None or not self._simulation.shown:
            return []
        begins = np.flatnonzero(np.diff(playback.path, prepend=-1))[:_MOST_PARTS]
        ends = [*playback.times[begins[1:]], playback.seconds]
        parts = []
        for begin, end in zip(begins, ends, strict=True):
            path = playback.report["paths"][int(playback.path[begin])]
            missed = path["waypoints"] - path["reached"]
            region = self.context.editor.document.region(path["region"])
            colour = "#9aa0a6" if region is None else hexadecimal(np.array(region.colour))
            words = f"{path['region']}, {path['process']}: {missed or 'no'} waypoints not reached"
            start = float(playback.times[begin])
            parts.append((round(start, 2), round(float(end) - start, 2), colour, words, missed > 0))
        return parts

    def _drawn(self) -> None:
        with self.context.lock:
            self.refresh()

    def _welcome(self, client: viser.ClientHandle) -> None:
        client.gui.add_html(_CLIENT.format(client.client_id))
        self.context.pen.opened(client.client_id)
        self._drawn()

    def _left(self, client: viser.ClientHandle) -> None:
        self.context.pen.closed(client.client_id)
        self._drawn()

    def _act(self, values: Mapping[str, str]) -> dict[str, object]:
        name = values["name"]
        return self._soon(values, lambda _: self._panel.take(name))

    def _lasso(self, values: Mapping[str, str]) -> dict[str, object]:
        corners = [part.split(",") for part in values["points"].split(";")]
        outline = np.array(corners[:_MOST_CORNERS], np.float64)
        if outline.ndim != 2 or outline.shape[1] != 2 or not np.isfinite(outline).all():
            raise ValueError("an outline has x and y for each point")
        if len(outline) < 3:
            return {}
        return self._soon(values, lambda client: self.mouse.select_outline(client, outline))

    def _hover(self, values: Mapping[str, str]) -> dict[str, object]:
        screen = float(values["x"]), float(values["y"])
        camera = camera_of(self._client(values))
        # Not at all rather than late: the server has other things to do.
        if not self.context.lock.acquire(timeout=0.01):
            return {}
        try:
            return {"text": _plain(self.mouse.under(camera, screen)).replace(", x", "\nx")}
        finally:
            self.context.lock.release()

    def _look_only(self, values: Mapping[str, str]) -> dict[str, object]:
        self.context.pen.only_look(self._client(values).client_id)
        return {}

    def _take_pen(self, values: Mapping[str, str]) -> dict[str, object]:
        page = self._client(values).client_id

        def take() -> None:
            self.context.pen.take(page)
            self.refresh()

        self._inputs.soon(take)  # after what the other page did
        return {}

    def _show_target(self, values: Mapping[str, str]) -> dict[str, object]:
        name = values["name"]

        def show(_: viser.ClientHandle) -> None:
            self.context.show_target(name or None)

        return self._soon(values, show)

    def _seek(self, values: Mapping[str, str]) -> dict[str, object]:
        time_s = float(values["time"])
        if not np.isfinite(time_s):
            raise ValueError("a time must be a number")
        return self._soon(values, lambda _: self._jump(time_s))

    def _jump(self, time_s: float) -> None:
        self._simulation.seek(time_s)
        self._simulation.on_time()

    def _soon(
        self, values: Mapping[str, str], act: Callable[[viser.ClientHandle], None]
    ) -> dict[str, object]:
        client = self._client(values)
        if self.context.pen.may_change(client.client_id):
            self._inputs.soon(lambda: act(client))
        return {}

    def _client(self, values: Mapping[str, str]) -> viser.ClientHandle:
        """The browser that asks. Raises KeyError for one that has gone."""
        return self.context.server.get_clients()[int(values["client"])]


def _plain(markdown: str) -> str:
    return markdown.replace("**", "")
