"""The studio: session, scene, mouse, arm simulation and panel, put together."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import viser

from nrdf.studio.arm_simulation import ArmSimulation
from nrdf.studio.context import StudioContext
from nrdf.studio.model.computing import ChildProcessComputing, LocalComputing
from nrdf.studio.model.document import REFERENCE
from nrdf.studio.model.session import Session
from nrdf.studio.model.studio_cell import StudioCell
from nrdf.studio.model.worker import Worker
from nrdf.studio.mouse import Mouse
from nrdf.studio.panels.inputs import ProgressBar
from nrdf.studio.panels.panel import Panel

if TYPE_CHECKING:
    pass

_SIZE = 720, 600  # of a page that is not open yet
_TOOLS, _ROW = 1250, 30  # length of the tools, and height of each of their rows, in pixels
_STRIP, _LINE = 132, 40  # pixels that they cover at the right and the bottom
_PATCH = 0.08  # first radius of a patch, in longest sides of the object


class Studio(StudioContext):
    """A session in every browser that is connected; arguments as of `StudioContext`."""

    def __init__(
        self,
        session: Session,
        server: viser.ViserServer,
        computing: LocalComputing | ChildProcessComputing,
        categories: Sequence[str],
        origin: Mapping[str, Any],
        cell: StudioCell | None = None,
    ) -> None:
        super().__init__(session, server, computing, categories, origin, cell or StudioCell())
        self.mouse = Mouse(self)
        self.arm_simulation = ArmSimulation(self)
        self.panel = Panel(self, self.mouse, self.arm_simulation, lambda: self.worker.cancel())
        working, simulating = self.panel.working, self.panel.simulating
        self.worker = Worker(working.started, working.progress, self._ended(working))
        self.arm_simulation.connect(simulating, self._ended(simulating))
        server.on_client_connect(self._welcome)
        self._asked = False  # nothing is computed before a person does something
        self.restore()
        self._asked = True
        if session.damage:
            self.show_error(f"⚠ **The session was damaged**: {session.damage}")

    def restore(self) -> None:
        """Show the session from the beginning. Nothing is computed until a person asks for it."""
        with self.lock:
            self.worker.cancel()
            self.arm_simulation.worker.cancel()
            self.arm_simulation.clear()
            self.scene.clear(1.0)
            self.results.by_target.clear()
            self._forget_similarity()
            self.mouse.forget_patch()
            self.region, self.step, self.shown_target = "", 0, None
            self.sync()

    def sync(self) -> None:
        """Bring scene and panel to what the document says."""
        with self.lock:
            keys = self.editor.object_keys()
            self._sync_reference(keys)
            gone = [key for key in self.scene.objects if key not in keys or self._is_stale(key)]
            new = [key for key in keys if key not in self.scene.objects or key in gone]
            for key in gone:
                self.scene.remove(key)
                self.results.by_target.pop(key, None)
            for key in new:
                self.scene.add(key, self.editor.paintable(key), self._upright(key))
            self._sync_selection()
            self.arm_simulation.check_object()
            if gone or new:
                self.arrange()
                if self._asked:
                    self.make_surfaces()
            self.mouse.update_callbacks()
            self.draw()
            self.panel.refresh()

    def _sync_reference(self, keys: Sequence[str]) -> None:
        """Empty the scene where it has another reference, and scale it to the new one."""
        drawn = self.scene.objects.get(REFERENCE)
        if drawn is not None and (
            REFERENCE not in keys or drawn.paintable is not self.editor.paintable(REFERENCE)
        ):
            self.scene.clear(1.0)
        if REFERENCE in keys and REFERENCE not in self.scene.objects:
            side = self.editor.paintable(REFERENCE).longest_side
            self.scene.clear(1.0 / side)
            self.radius_m = _PATCH * side

    def _upright(self, key: str) -> np.ndarray:
        """(3, 3) from an object's own axes to those in which it stands."""
        target = self.editor.target(key)
        placement = None if target is None else target.object.placement
        return np.eye(3) if placement is None else placement.upright

    def _is_stale(self, key: str) -> bool:
        """Whether an object is drawn that has other points now, or stands in another way."""
        drawn = self.scene.objects[key]
        if drawn.paintable is not self.editor.paintable(key):
            return True
        return not np.array_equal(drawn.upright, self._upright(key))

    def _sync_selection(self) -> None:
        """Select a region and a process step that exist."""
        document = self.editor.document
        region = document.region(self.region)
        if region is None:
            region = document.regions[-1] if document.regions else None
            self.region, self.step = ("" if region is None else region.name), 0
        self.step = min(self.step, len(region.steps) - 1) if region else 0

    def visible_objects(self) -> list[str]:
        """The keys of the objects that are to be seen: with an arm, the one that it works on."""
        if self.arm_simulation.shown:
            return [self.arm_simulation.key]
        keys, target = self.editor.object_keys(), self.shown_target
        return [k for k in keys if k in (REFERENCE, target) or target is None]

    def arrange(self) -> None:
        """Put the visible objects side by side, and let every camera see all of them."""
        visible = self.visible_objects()
        self.scene.arrange(visible)
        self.arm_simulation.follow_object()
        arm_points = self.arm_simulation.occupied_points
        free = self._free_part(*_SIZE)
        position, look_at = self.scene.camera(visible, _SIZE[0] / _SIZE[1], arm_points, free)
        initial = self.server.initial_camera
        initial.position, initial.look_at = tuple(position), tuple(look_at)
        for client in self.server.get_clients().values():
            size = client.camera.image_width, client.camera.image_height
            free = self._free_part(*size)
            position, look_at = self.scene.camera(visible, size[0] / size[1], arm_points, free)
            with client.atomic():
                client.camera.position = position
                client.camera.look_at = look_at

    def _free_part(self, width: int, height: int) -> tuple[float, float, float, float]:
        """Left, top, right and bottom, in shares, of what tools, small pictures and time line
        leave of a window of that size in pixels."""
        strip = _STRIP if len(self.editor.document.targets) > 1 else 0
        line = _LINE if self.arm_simulation.shown else 0
        tools = 8 + _ROW * -(-_TOOLS // width)
        right, bottom = 1 - min(strip / width, 0.3), 1 - min(line / height, 0.1)
        return 0.0, min(tools / height, 0.3), right, bottom

    def refresh_panel(self) -> None:
        """Show in the panel what the document, the plans and the results say."""
        self.panel.refresh()

    def show_error(self, text: str) -> None:
        """Show in the panel what went wrong last; "" removes it."""
        self.panel.show_error(text)

    def stop(self) -> None:
        """End all background work."""
        self.worker.stop()
        self.results.stop()
        self.arm_simulation.stop()
        self.panel.overlay.thumbnails.stop()

    def _ended(self, bar: ProgressBar) -> Callable[[str, str], None]:
        """What a worker calls when a job has ended: (what it was, error or "")."""

        def ended(what: str, error: str) -> None:
            bar.ended()
            self.notify_end(what, error)
            with self.lock:
                self.panel.refresh()

        return ended

    def _welcome(self, client: viser.ClientHandle) -> None:
        session = self.editor.session
        if session.restored and self.editor.document.reference is not None:
            text = f"as you left it, from the folder {session.folder.name}"
            client.add_notification("Your session is here", text, auto_close_seconds=8)
