"""Tables: dining, coffee, side, bar tables and desks; wider along z than deep along x. Metres."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nrdf.shapes.families import furniture as fu
from nrdf.shapes.families.base import (
    CAP_START,
    CAP_STOP,
    SIDE,
    Affine,
    Part,
    SurfaceCoordinates,
    Window,
    rotation,
)
from nrdf.shapes.families.furniture import LegStyle, Stand, bar, chance, pick
from nrdf.shapes.families.member import Family
from nrdf.shapes.families.sections import Superellipse, linear, rounded, smooth

_END_SLOTS = tuple(f"{what}-{side}" for what in ("end", "foot", "drawer") for side in fu.SIDES)

# height, half-width (z), half-depth (x); round tops take the smaller half for both
_SIZES = {
    "dining": ((0.7, 0.8), (0.45, 1.2), (0.36, 0.55)),
    "desk": ((0.7, 0.78), (0.5, 0.95), (0.28, 0.42)),
    "coffee": ((0.28, 0.5), (0.35, 0.75), (0.2, 0.45)),
    "side": ((0.4, 0.68), (0.17, 0.35), (0.17, 0.3)),
    "bar": ((0.9, 1.12), (0.25, 0.7), (0.25, 0.35)),
}
_SUPPORTS = {
    "legs": 7.0,
    "corner": 2.0,
    "scissor": 0.8,
    "sled": 1.0,
    "ends": 1.5,
    "trestle": 1.5,
    "pedestal": 2.5,
}


class TableFamily(Family):
    """Tables with round to rectangular tops on legs, runners, end panels, trestles, a pedestal."""

    name = "table"
    slots = (
        "top",
        "shelf",
        *fu.LEG_SLOTS,
        *fu.STRETCHER_SLOTS,
        *fu.APRON_SLOTS,
        *fu.RUNNER_SLOTS,
        *fu.PEDESTAL_SLOTS,
        *_END_SLOTS,
    )
    region_names = ("top", "top-edge", "top-bottom", "shelf", *fu.LEG_SLOTS)

    def build(self, rng: np.random.Generator) -> list[Part]:
        size = _SIZES[pick(rng, {"dining": 3, "desk": 2, "coffee": 3, "side": 2, "bar": 1})]
        height, width, depth = (rng.uniform(*bounds) for bounds in size)
        support = pick(rng, _SUPPORTS)
        depth = min(depth, width)
        e = float(rng.choice([2.0, 2.5, 4.0, 8.0, 40.0], p=[0.25, 0.07, 0.13, 0.2, 0.35]))
        if support == "pedestal" or (e == 2.0 and chance(rng, 0.7)):
            width = min(width, depth * rng.choice([1.0, 1.0, rng.uniform(1, 1.4)]))
        thickness = float(np.exp(rng.uniform(np.log(0.01), np.log(0.07))))
        fillet = min(rng.uniform(0, 0.8) * thickness / depth, 0.2)
        edges = rng.uniform(0, 0.5), rng.uniform(0, 0.5)
        a, b = (rounded(x, *edges, depth=fillet) for x in (width, depth))
        top = Part("top", 1, height - thickness, height, Superellipse(a, b, e))
        corner = 2 ** (-1 / e)
        under = height - thickness / 2
        if support == "pedestal":
            radius, reach = rng.uniform(0.02, 0.09), depth * rng.uniform(0.5, 0.95)
            return [top, *fu.pedestal(rng, under, radius, reach, casters=False)]
        if support in ("ends", "trestle"):
            build = _ends if support == "ends" else _trestle
            return [top, *build(rng, under, width * corner, depth * corner)]
        return [top, *_legged(rng, support, height - thickness, under, width, depth, corner)]

    def region_of(self, coordinates: SurfaceCoordinates) -> NDArray[np.str_]:
        c = coordinates
        out = np.full(len(c), "", dtype="<U16")
        top = c.slot == self.slot("top")
        for face, name in ((CAP_STOP, "top"), (SIDE, "top-edge"), (CAP_START, "top-bottom")):
            out[top & (c.face == face)] = name
        out[(c.slot == self.slot("shelf")) & (c.face == CAP_STOP)] = "shelf"
        for name in fu.LEG_SLOTS:
            out[c.slot == self.slot(name)] = name
        return out


def _legged(
    rng: np.random.Generator,
    kind: str,
    bottom: float,
    under: float,
    width: float,
    depth: float,
    corner: float,
) -> list[Part]:
    """Four legs with what goes between them: apron, stretchers or a shelf, runners, drawers."""
    style = LegStyle.random(rng, min(rng.uniform(0.012, 0.05), 0.12 * depth))
    inset = corner * (1 - style.size / depth)
    if kind != "corner":
        inset *= rng.uniform(0.75, 1.0)
    floor = style.size if kind == "sled" else 0.0
    spread = rng.uniform(0, 0.25) if chance(rng, 0.4) else 0.0
    foot, top = {}, {}
    for end, sign in (("front", 1.0), ("rear", -1.0)):
        x, z = sign * inset * depth, inset * width
        if corner > 0.9:  # rectangular: the same distance from both edges
            z = width - (1 - inset) * depth
        out = spread * min(bottom, depth)
        top[end] = np.array([x, under, z])
        foot[end] = np.array([x + sign * out * rng.uniform(0.5, 1), floor, z + 0.5 * out])
    foot["rear"][2] = foot["front"][2]
    if kind == "scissor":
        for end, other in (("front", -1), ("rear", 1)):
            top[end][0] = other * 0.8 * inset * depth
            top[end][2] -= 1.6 * style.size * (end == "rear")
            foot[end][2] = top[end][2]
    stand = Stand(foot, top, style)
    parts = stand.leg("front") + stand.leg("rear")
    if kind == "sled":
        parts += fu.runners(rng, stand, foot["rear"][0])
    if kind == "scissor":
        middle = bar("stretcher-middle", 2, *_across(0.5 * bottom, top["rear"][2]), (0.02, 0.02))
        return [*parts, middle]
    apron = kind == "corner" or chance(rng, 0.5)
    if apron:
        half = min(rng.uniform(0.02, 0.06), 0.12 * bottom)
        y = bottom - half + 0.004
        heights = {"left": y, "front": y, "rear": y}
        parts += stand.rails("apron", heights, (half, style.size * rng.uniform(0.3, 0.95)), 40.0)
    extra = pick(rng, {"none": 4, "stretchers": 2.5, "shelf": 1.8, "drawers": 1.5})
    if extra == "stretchers":
        parts += fu.random_stretchers(rng, stand, floor, bottom)
    elif extra == "shelf":
        y, thin = bottom * rng.uniform(0.12, 0.55), rng.uniform(0.006, 0.02)
        front, rear = stand.at_height("front", y), stand.at_height("rear", y)
        half_x, half_z = (front[0] - rear[0]) / 2, (front[2] + rear[2]) / 2
        outline = Superellipse(half_z * rng.uniform(0.95, 1.02), half_x * 1.02, 20.0)
        centre = 0.0, float((front[0] + rear[0]) / 2)
        parts.append(Part("shelf", 1, y - thin, y + thin, outline, centre=centre))
    elif extra == "drawers" and inset > 0.7 and kind != "sled":
        parts += _drawers(rng, bottom, top["front"], style)
    return parts


def _across(y: float, z: float) -> tuple[np.ndarray, np.ndarray]:
    """The two ends of a bar along z at x = 0 and height y."""
    return np.array([0.0, y, -z]), np.array([0.0, y, z])


def _drawers(
    rng: np.random.Generator, bottom: float, corner: np.ndarray, style: LegStyle
) -> list[Part]:
    """Boxes hung under the top between the legs."""
    tall = bottom * rng.uniform(0.15, 0.75)
    half_z = corner[2] * rng.uniform(0.18, 0.4)
    box = Superellipse(half_z, corner[0] * rng.uniform(0.85, 1.0), 40.0)
    z = corner[2] - half_z - style.size * rng.uniform(0.0, 0.5)
    right = Part("drawer-right", 1, bottom - tall, bottom + 0.004, box, centre=(z, 0.0))
    return [right, right.mirrored("drawer-left")] if chance(rng, 0.6) else [right]


def _ends(rng: np.random.Generator, under: float, width: float, depth: float) -> list[Part]:
    """Panels from the floor to the top at both ends, solid or framed, joined by a rail or shelf."""
    half = rng.uniform(0.008, 0.03)
    z = (width - half) * rng.uniform(0.8, 1.0)
    reach = depth * rng.uniform(0.7, 0.98)
    outline = linear([0, 1], [reach, reach * rng.uniform(0.7, 1.0)])
    windows: tuple[Window, ...] = ()
    if chance(rng, 0.4):
        side, low = rng.uniform(0.06, 0.2), rng.uniform(0.04, 0.15)
        windows = (Window(0, (low + 0.93) / 2, 1 - side, (0.93 - low) / 2, key=0),)
    lean = linear([0, 1], [0.0, -rng.uniform(0, 0.12) * z])
    section = Superellipse(outline, half, 40.0)
    right = Part("end-right", 1, 0.0, under, section, centre=(0.0, lean), windows=windows)
    right = right.mapped(_turn(z))
    parts = [right, right.mirrored("end-left")]
    low_y = under * rng.uniform(0.15, 0.6)
    if chance(rng, 0.4):
        size = rng.uniform(0.01, 0.03), rng.uniform(0.02, 0.06)
        parts.append(bar("stretcher-middle", 2, *_across(low_y, z * 0.97), size, 40.0))
    elif chance(rng, 0.4):
        half_z = z + float(np.ravel(lean(np.array([low_y / under])))[0])
        box = Superellipse(half_z, reach * 0.85, 40.0)
        parts.append(Part("shelf", 1, low_y - 0.01, low_y + 0.01, box))
    return parts


def _turn(z: float) -> Affine:
    """Local +z becomes -x and local +x becomes +z, at distance z to the right."""
    turn = rotation(1, -np.pi / 2)
    return turn.then(Affine(shift=np.array([0.0, 0.0, z])))


def _trestle(rng: np.random.Generator, under: float, width: float, depth: float) -> list[Part]:
    """A column and a foot at each end, joined by a stretcher."""
    z = width * rng.uniform(0.5, 0.8)
    foot = rng.uniform(0.02, 0.045), rng.uniform(0.025, 0.05)
    half = rng.uniform(0.02, 0.05), rng.uniform(0.03, min(0.16, 0.5 * depth))
    waist = rng.uniform(0.6, 1.2)
    e = float(rng.choice([2.0, 8.0, 40.0]))
    section = Superellipse(smooth([0, 0.5, 1], half[1] * np.array([1, waist, 1.1])), half[0], e)
    column = Part("end-right", 1, foot[0], under, section).mapped(_turn(z))
    reach = depth * rng.uniform(0.65, 0.95)
    taper = smooth([0, 0.5, 1], foot[0] * np.array([rng.uniform(0.5, 1), 1, 0.6]))
    base = Part("foot-right", 0, -reach, reach, Superellipse(taper, foot[1], 12.0), (foot[0], z))
    parts = [column, column.mirrored("end-left"), base, base.mirrored("foot-left")]
    if chance(rng, 0.8):
        size = rng.uniform(0.012, 0.025), rng.uniform(0.02, 0.05)
        ends = _across(under * rng.uniform(0.2, 0.75), z)
        parts.append(bar("stretcher-middle", 2, *ends, size, 40.0))
    return parts


FAMILY = TableFamily()
