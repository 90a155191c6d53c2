"""Types of aircraft: typical measures, and random aircraft around them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_HEADER = """
radius aspect square nose tail span chord taper sweep edge mount dihedral thick
tail_span tail_chord tail_sweep fin_height fin_chord fin_sweep
"""
"""Half the fuselage's height; its width to height, exponent of its section, lengths of nose and
tail cone; full span, chord at the plane of symmetry, tip to root chord, sweep of the leading edge,
station of the root's leading edge behind the nose, height of the wing in radii, dihedral, thickness
of the root's section; the same of tail plane and fin (height above the axis)."""

_TYPES = """
airliner   14 54 100 20 110 330  900 210 22 29 350 -65  6 13 340 105 34 205 170 40
quad        6 49 100 20 100 330  900 250 24 36 310 -65  7 12 340 110 37 200 180 42
regional    6 43 100 20 110 330  770 190 26 25 440 -70  3 11 300  95 28 190 150 40
trijet      3 50 100 20 110 330  850 230 25 34 390 -65  5 12 340 110 36 200 180 42
bizjet      8 57 100 20 180 350  920 175 30 22 430 -80  3 11 380  95 26 205 160 44
turboprop   5 52 100 20 130 380 1060 120 50  3 370  85  2 15 340 100  8 230 170 32
transport   4 68 105 23 130 400 1120 155 45  8 350  88 -1 15 430 120 15 270 180 30
twin        5 68  90 24 260 450 1180 175 55  4 330 -60  6 14 390 110 10 210 150 32
high-wing   8 80  88 28 160 520 1350 185 78  1 240  95  2 13 400 120  5 200 150 30
low-wing    7 74  92 26 180 520 1250 190 70  3 270 -75  6 14 370 115  8 200 150 30
warbird     7 70  85 22 160 600 1170 255 50  5 235 -50  6 14 380 130  8 190 150 22
fighter     6 60 105 22 240 380  780 290 42 40 360   0  0  8 360 130 42 210 230 48
delta       6 60 115 24 260 320  580 520  9 57 350 -20 -2  6 300 120 50 220 250 52
twin-fin    6 52 170 28 300 300  680 370 26 40 380  10 -1  7 420 150 42 210 180 40
interceptor 4 54 110 22 300 260  500 240 34 30 430   0 -3  6 300 120 34 210 180 42
attack      5 66 105 22 220 400  980 205 50 12 340   0  4 12 380 115 16 220 170 30
glider      4 50  92 20 200 500 2150 120 40  1 320  40  3 14 380  80  5 190 130 14
bomber      3 50  95 24 150 550 1380 210 45  6 270 -20  5 15 420 125  8 190 130 20
"""
"""Weight; then the columns, lengths in thousandths of the fuselage, ratios in per cent (square in
tenths), angles in degrees."""

_RECIPES = {
    # fuselage, {tail: weight}, {engines: weight}
    "airliner": ("tube", "low", "pod-2"),
    "quad": ("tube", "low", "pod-4"),
    "regional": ("tube", "tee tee mid", "rear-2"),
    "trijet": ("tube", "low tee", "pod-3 rear-3"),
    "bizjet": ("sleek", "tee mid tee low", "rear-2 rear-2 rear-2 rear-3 rear-2"),
    "turboprop": ("tube", "tee low tee mid", "prop-2"),
    "transport": ("tube", "tee low", "pod-4 prop-4 prop-4 pod-2"),
    "twin": ("cabin", "low low tee mid", "prop-2"),
    "high-wing": ("cabin", "low low low mid", "nose nose nose none"),
    "low-wing": ("cabin", "low low mid tee vee", "nose nose nose none"),
    "warbird": ("warbird", "low", "nose nose nose none"),
    "fighter": ("jet", "low low mid", "none"),
    "delta": ("jet", "none none canard", "none none nozzles"),
    "twin-fin": ("jet", "twin", "nozzles"),
    "interceptor": ("jet", "low low tee mid", "none none nozzles"),
    "attack": ("jet", "low low mid ends vee", "none rear-2 pod-2 nozzles"),
    "glider": ("pod", "tee tee low vee", "none"),
    "bomber": ("tube", "low ends", "prop-4 prop-4 prop-2"),
}
"""Fuselage, and the tails and engines to draw from.

Tails: plane at the fuselage (low), on the fin's middle (mid) or tip (tee), V, twin fins on the
fuselage (twin) or at the plane's ends (ends), fin only (none), fin and canards (canard). Engines:
pods below the wing, at the rear, propellers on the wing or nose, twin nozzles, inside (none)."""

_SPREAD = {
    "radius": 0.1, "aspect": 0.05, "nose": 0.28, "tail": 0.12, "span": 0.09, "chord": 0.1,
    "taper": 0.2, "tail_span": 0.1, "tail_chord": 0.1, "fin_height": 0.1, "fin_chord": 0.12,
    "thick": 0.12,
}  # fmt: skip
_SHIFT = {
    "edge": 0.022, "mount": 0.1, "sweep": 0.055, "dihedral": 0.02, "square": 0.15,
    "tail_sweep": 0.06, "fin_sweep": 0.08,
}  # fmt: skip
"""Standard deviations, of the logarithm and absolute."""

_COLUMNS = _HEADER.split()
_ROWS = [row.split() for row in _TYPES.strip().splitlines()]
_NAMES = [row[0] for row in _ROWS]
_WEIGHTS = np.array([float(row[1]) for row in _ROWS])
_DEGREE = np.pi / 180
_UNITS = {
    "aspect": 0.01,
    "square": 0.1,
    "taper": 0.01,
    "mount": 0.01,
    "thick": 0.01,
} | dict.fromkeys(("sweep", "dihedral", "tail_sweep", "fin_sweep"), _DEGREE)


@dataclass(frozen=True)
class Style:
    """A random aircraft's plan; angles in rad, lengths in fuselage lengths (see the header)."""

    kind: str
    fuselage: str
    tail_kind: str
    engines: str
    radius: float
    aspect: float
    square: float
    nose: float
    tail: float
    span: float
    chord: float
    taper: float
    sweep: float
    edge: float
    mount: float
    dihedral: float
    thick: float
    tail_span: float
    tail_chord: float
    tail_sweep: float
    fin_height: float
    fin_chord: float
    fin_sweep: float


def random_style(rng: np.random.Generator) -> Style:
    """One of the types by weight, jittered."""
    index = int(rng.choice(len(_ROWS), p=_WEIGHTS / _WEIGHTS.sum()))
    fuselage, tails, engines = _RECIPES[_NAMES[index]]
    d = {}
    for key, text in zip(_COLUMNS, _ROWS[index][2:], strict=True):
        value = float(text) * _UNITS.get(key, 0.001)
        bump = float(np.clip(rng.normal(), -2, 2))
        value *= np.exp(_SPREAD.get(key, 0.0) * bump)
        d[key] = float(value + _SHIFT.get(key, 0.0) * bump)
    d["nose"] = min(d["nose"], 0.4)
    d["square"] = max(d["square"], 1.9)
    d["sweep"] = max(d["sweep"], -0.03)
    return Style(
        _NAMES[index],
        fuselage,
        str(rng.choice(tails.split())),
        str(rng.choice(engines.split())),
        **d,
    )
