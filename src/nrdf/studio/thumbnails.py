"""Small pictures of targets with their tool paths, drawn in the background."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from nrdf.reports.job_folder import panel_of
from nrdf.studio.model.result_cache import TargetResult
from nrdf.viz.picture import render_panels
from nrdf.viz.sheet import png_of

log = logging.getLogger(__name__)

_WIDTH = 140

Colours = Mapping[str, tuple[int, int, int]]


class Thumbnails:
    """One picture for each target, of its newest result. ready: called when one was drawn."""

    def __init__(self, ready: Callable[[], None]) -> None:
        self._ready = ready
        self._asked: dict[str, tuple[TargetResult, Colours]] = {}
        self._drawn: dict[str, tuple[str, bytes]] = {}
        self._executor = ThreadPoolExecutor(1, "studio thumbnails")

    def stamp(self, name: str, result: TargetResult | None, colours: Colours) -> str:
        """What differs for different pictures of a target; one that is missing is drawn soon.

        colours: of its regions, 0 to 255.
        """
        if result is None:
            return ""
        stamp = f"{id(result)}-{hash(tuple(sorted(colours.items())))}"
        asked = self._asked.get(name)
        if asked is None or asked[0] is not result or asked[1] != colours:
            self._asked[name] = result, dict(colours)
            self._executor.submit(self._draw, name, result, dict(colours), stamp)
        drawn = self._drawn.get(name)
        return stamp if drawn is not None and drawn[0] == stamp else ""

    def png(self, name: str) -> bytes:
        """The last picture of a target. Raises KeyError where there is none yet."""
        return self._drawn[name][1]

    def stop(self) -> None:
        """Draw no more."""
        self._executor.shutdown(wait=False, cancel_futures=True)

    def _draw(self, name: str, result: TargetResult, colours: Colours, stamp: str) -> None:
        own = {region: np.array(colour) / 255 for region, colour in colours.items()}
        try:
            rows, _ = render_panels([panel_of(result.transfer_result, name)], _WIDTH, own)
        except Exception:  # a picture less is no reason to stop
            log.exception("no thumbnail of %s", name)
            return
        self._drawn[name] = stamp, png_of(rows[0][0])
        self._ready()
