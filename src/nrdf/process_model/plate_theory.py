"""A flat plate worked by parallel passes at one feed: the stepover that is most even, in theory."""

from __future__ import annotations

import numpy as np

from nrdf.process_model.removal import Pad
from nrdf.process_model.spray_profile import SprayProfile

_PLACES, _CHORD = 400, 200
_EVEN, _PAD_EVEN = 0.01, 0.04
"""Standard deviation over mean, below which a stepover is even enough: a pad's strip ends steeply,
and would be even to 1 % in very many lines only."""
_LEAST, _MOST, _TRIES = 0.15, 1.6, 117  # half-widths that a stepover is


def strip_of(tool: SprayProfile | Pad, across_m: np.ndarray) -> np.ndarray:
    """What one pass leaves on a plate at places (n,) m beside its middle, in units of its own."""
    if isinstance(tool, SprayProfile):
        return tool.strip(across_m, 1.0)
    half = np.sqrt(np.maximum(tool.radius_m**2 - across_m**2, 0.0))
    if tool.orbit_m > 0.0 or tool.spindle_rad_s == 0.0:
        return half
    along = half[:, None] * (np.arange(_CHORD) + 0.5) / _CHORD
    return np.asarray(np.hypot(across_m[:, None], along).mean(axis=1) * half)


def variation(tool: SprayProfile | Pad, stepover_m: float) -> float:
    """Standard deviation over mean, of passes that far apart on an endless plate."""
    wide = half_width(tool)
    places = (np.arange(_PLACES) + 0.5) / _PLACES * stepover_m
    passes = np.arange(-np.ceil(wide / stepover_m) - 1, np.ceil(wide / stepover_m) + 2)
    away = places[:, None] - stepover_m * passes
    film = strip_of(tool, away.ravel()).reshape(away.shape).sum(axis=1)
    return float(film.std() / film.mean())


def best_stepover(tool: SprayProfile | Pad) -> float:
    """The widest stepover, m, below which passes on a plate are even to 1 % at any, to 4 % of a
    pad: wider ones may be even too, on a plate, but bends change the stepover."""
    enough = _EVEN if isinstance(tool, SprayProfile) else _PAD_EVEN
    tries = half_width(tool) * np.linspace(_LEAST, _MOST, _TRIES)
    uneven = np.array([variation(tool, float(stepover)) > enough for stepover in tries])
    return float(tries[max(int(uneven.argmax()) - 1, 0)])


def half_width(tool: SprayProfile | Pad) -> float:
    """How far a pass reaches to either side, m."""
    return tool.ends_m[0] if isinstance(tool, SprayProfile) else tool.radius_m
