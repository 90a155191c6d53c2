"""A clock that plays, pauses, and goes faster than real time."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

_TICK_S = 0.05


class Player:
    """Calls `advance(seconds)` while it plays, until that returns False, in a thread of its own."""

    def __init__(self, advance: Callable[[float], bool]) -> None:
        self.speed = 1.0
        self._advance = advance
        self._playing = self._stopped = False
        self._changed = threading.Condition()
        threading.Thread(target=self._run, name="studio player", daemon=True).start()

    @property
    def playing(self) -> bool:
        """Whether it plays."""
        return self._playing

    def play(self) -> None:
        """Start to play."""
        self._set(playing=True)

    def pause(self) -> None:
        """Pause."""
        self._set(playing=False)

    def stop(self) -> None:
        """End the thread."""
        with self._changed:
            self._stopped, self._playing = True, False
            self._changed.notify_all()

    def _set(self, playing: bool) -> None:
        with self._changed:
            self._playing = playing
            self._changed.notify_all()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._playing or self._stopped)
                if self._stopped:
                    return
            last = time.monotonic()
            while self._playing:
                time.sleep(_TICK_S)
                now = time.monotonic()
                if self._playing and not self._advance(self.speed * (now - last)):
                    self.pause()
                last = now
