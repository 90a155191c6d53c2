"""MuJoCo, imported when it is needed, with a way to draw that this machine has."""

from __future__ import annotations

import importlib
import os
import sys
from typing import Any

from nrdf.errors import RobotError


class _Lazy:
    """The module `mujoco`, imported at the first use.

    MuJoCo looks at MUJOCO_GL once, on import. Without a display only EGL draws, and the default
    would not.
    """

    def __getattr__(self, name: str) -> Any:
        if "mujoco" not in sys.modules and sys.platform == "linux":
            shown = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
            if not shown:
                os.environ.setdefault("MUJOCO_GL", "egl")
        try:
            return getattr(importlib.import_module("mujoco"), name)
        except ImportError as error:
            raise RobotError(
                f"simulation needs the package mujoco ({error}): pip install 'nrdf[robot]'"
            ) from None


mujoco: Any = _Lazy()
