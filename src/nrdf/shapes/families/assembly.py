"""Kinds of objects drawn at random, each a small parametric family of its own.

A kind is a tree of lofts: bars, slabs, blocks and long bodies that grow out of each other, once, in
mirrored pairs or in fours. Its members have other proportions, profiles and sections, and may lack
parts. So the same surface coordinates are the same place on all of them, and what varies is what
varies within a category. No kind is meant to be anything.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nrdf.shapes.families.base import MIRROR_Z, Affine, Array, Part, rotation
from nrdf.shapes.families.member import Member
from nrdf.shapes.families.sections import Airfoil, Curve, Superellipse, linear, rounded, smooth

_STYLES = ("bar", "slab", "block", "long")
_EXPONENTS = (2.0, 3.0, 6.0, 20.0)  # of sections: from round to square
_KNOTS = 4  # of a profile
_MIRROR_X = Affine(np.diag([-1.0, 1.0, 1.0]))


@dataclass(frozen=True)
class _Limb:
    """How a part of a kind is on the average. parent: its number, -1 for the body. size (3,) half
    extents; anchor (3,) place on the parent, in shares of its half extents, and toward (3,) the
    signs of the axes along which it grows from there; lean (2,) of the centre line, tilt (rad)."""

    parent: int
    axis: int
    size: Array
    copies: int
    anchor: Array
    toward: Array
    profile: Array
    exponent: float
    lean: Array
    tilt: float
    tilt_axis: int
    ends: Array
    is_airfoil: bool
    presence: float


class Kind:
    """A kind of objects, drawn with `rng`. slots: names of the parts that its members may have."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._spread = rng.uniform(0.12, 0.45)
        self._limbs = [_draw_limb(rng, [], -1)]
        for _ in range(rng.integers(2, 7)):
            parent = 0 if rng.random() < 0.65 else int(rng.integers(len(self._limbs)))
            self._limbs.append(_draw_limb(rng, self._limbs, parent))
        self.slots = tuple(
            f"{number}-{copy}"
            for number, limb in enumerate(self._limbs)
            for copy in range(limb.copies)
        )

    def member(self, rng: np.random.Generator) -> Member:
        """A random member."""
        spread = self._spread
        whole = np.exp(rng.normal(0, spread, 3))
        boxes: list[tuple[Array, Array]] = []
        missing: set[int] = set()
        parts: list[Part] = []
        for number, limb in enumerate(self._limbs):
            size = limb.size * np.exp(rng.normal(0, spread, 3)) * whole
            centre = np.zeros(3)
            if limb.parent >= 0:
                centre = _place(limb, size, boxes[limb.parent], 0.5 * spread, rng)
            boxes.append((centre, size))
            if limb.parent in missing or rng.random() > limb.presence:
                missing.add(number)
                continue
            part = _loft(limb, f"{number}-0", centre, size, spread, rng)
            copies = [part]
            if limb.copies >= 2:
                copies.append(part.mapped(MIRROR_Z, slot=f"{number}-1"))
            if limb.copies == 4:
                copies.append(part.mapped(_MIRROR_X, slot=f"{number}-2"))
                copies.append(part.mapped(MIRROR_Z, _MIRROR_X, slot=f"{number}-3"))
            parts += copies
        return Member(self.slots, parts)


def _draw_limb(rng: np.random.Generator, limbs: list[_Limb], parent: int) -> _Limb:
    is_body = parent < 0
    shares = [0.0, 0.3, 0.3, 0.4] if is_body else [0.3, 0.35, 0.15, 0.2]
    style = _STYLES[rng.choice(4, p=shares)]
    size = 0.5 * np.exp(rng.normal(0, 0.3, 3))
    axis = int(rng.choice(3, p=[0.4, 0.35, 0.25]))
    if style == "bar":
        size *= 0.12
        size[axis] = rng.uniform(0.25, 0.8)
    elif style == "slab":
        size[rng.integers(3)] *= rng.uniform(0.05, 0.16)
    elif style == "long":
        size *= 0.35
        size[axis] = rng.uniform(0.6, 1.2)
    copies = 1
    if not is_body:
        size *= rng.uniform(0.35, 0.9)
        copies = limbs[parent].copies
        if copies == 1:
            copies = int(rng.choice([1, 2, 4], p=[0.4, 0.42, 0.18]))
    anchor, toward = _draw_anchor(rng, copies)
    return _Limb(
        parent=parent,
        axis=axis,
        size=size,
        copies=copies,
        anchor=anchor,
        toward=toward,
        profile=np.exp(rng.normal(0, 0.3 if rng.random() < 0.7 else 0.06, (2, _KNOTS))),
        exponent=float(rng.choice([2.0, *_EXPONENTS])),
        lean=rng.normal(0, 0.25, 2) * (rng.random() < 0.5),
        tilt=rng.normal(0, 0.35) * (rng.random() < 0.35),
        tilt_axis=int(rng.integers(3)),
        ends=rng.uniform(0, 0.5, 2) * (rng.random(2) < 0.4),
        is_airfoil=style == "slab" and rng.random() < 0.25,
        presence=1.0 if is_body else float(rng.choice([1.0, 1.0, 0.75])),
    )


def _draw_anchor(rng: np.random.Generator, copies: int) -> tuple[Array, Array]:
    """Where on its parent a limb grows, and which way: mostly in the middle plane if it is alone,
    on the +Z side (and the +X side) if it is mirrored."""
    anchor, toward = rng.uniform(-1, 1, 3), np.zeros(3)
    side = int(rng.integers(3))
    anchor[side] = rng.choice([-1, 1]) * rng.uniform(0.8, 1)
    toward[side] = np.sign(anchor[side])
    if copies > 1:
        anchor[2], toward[2] = rng.uniform(0.35, 1.0), abs(toward[2])
    elif rng.random() < 0.8:
        anchor[2] = toward[2] = 0.0
    if copies == 4:
        anchor[0], toward[0] = rng.uniform(0.4, 1.0), abs(toward[0])
    return anchor, toward


def _place(
    limb: _Limb, size: Array, parent: tuple[Array, Array], spread: float, rng: np.random.Generator
) -> Array:
    """The centre (3,) of a limb, so that it still touches its parent."""
    centre, extents = parent
    free = (limb.toward == 0) & (limb.anchor != 0)
    anchor = np.clip(limb.anchor + rng.normal(0, spread, 3) * free, -1.1, 1.1)
    placed = centre + anchor * extents + limb.toward * size * rng.uniform(0.8, 0.97)
    if limb.copies == 1 and limb.anchor[2] == 0:
        placed[2] = centre[2]
    return placed


def _loft(
    limb: _Limb, slot: str, centre: Array, size: Array, spread: float, rng: np.random.Generator
) -> Part:
    axis = limb.axis
    across = [(axis + 1) % 3, (axis + 2) % 3]
    profile = limb.profile * np.exp(rng.normal(0, 0.6 * spread, limb.profile.shape))
    profile /= profile.max(axis=1, keepdims=True)
    widths: list[Curve] = []
    for half, row in zip(size[across], profile, strict=True):
        curve: Curve = smooth(np.linspace(0, 1, _KNOTS), half * row)
        start, stop = limb.ends.tolist()
        widths.append(rounded(curve, start, stop) if limb.ends.any() else curve)
    exponent = limb.exponent if rng.random() < 0.7 else float(rng.choice(_EXPONENTS))
    section: Superellipse | Airfoil = Superellipse(widths[0], widths[1], exponent)
    if limb.is_airfoil:
        section = Airfoil(widths[0], float(np.clip(size[across[1]] / size[across[0]], 0.05, 0.3)))
    lean = limb.lean * size[axis] * np.exp(rng.normal(0, spread, 2))
    line = [
        linear([0, 1], [middle - off, middle + off])
        for middle, off in zip(centre[across], lean, strict=True)
    ]
    low, high = float(centre[axis] - size[axis]), float(centre[axis] + size[axis])
    part = Part(slot, axis, low, high, section, (line[0], line[1]))
    if limb.tilt:
        turned = rotation(limb.tilt_axis, limb.tilt + rng.normal(0, 0.3 * spread), centre.tolist())
        part = part.mapped(turned)
    return part
