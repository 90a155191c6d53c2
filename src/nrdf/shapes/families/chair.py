"""Chairs: dining, lounge, upholstered, office, shell, tub and bar chairs. Lengths in metres."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nrdf.shapes.families import furniture as fu
from nrdf.shapes.families.base import CAP_START, CAP_STOP, SIDE, Part, SurfaceCoordinates
from nrdf.shapes.families.chair_body import Back, Seat, random_back, random_seat
from nrdf.shapes.families.chair_styles import STYLES
from nrdf.shapes.families.furniture import SIDES, LegStyle, Stand, bar, chance, pick
from nrdf.shapes.families.member import Family
from nrdf.shapes.families.sections import Superellipse, linear, rounded, smooth

_ARM_SLOTS = tuple(f"{what}-{side}" for what in ("arm", "arm-post", "arm-panel") for side in SIDES)
_WING_SLOTS = tuple(f"wing-{side}" for side in SIDES)


def _both(right: Part) -> list[Part]:
    """The right part (slot ...-right) and its mirror image."""
    return [right, right.mirrored(right.slot.removesuffix("right") + "left")]


def _support(rng: np.random.Generator, kind: str, seat: Seat) -> list[Part]:
    if kind in ("pedestal", "office"):
        reach = rng.uniform(0.75, 1.25) * min(max(seat.half_width, seat.half_depth), 0.3)
        radius = rng.uniform(0.018, 0.05)
        return fu.pedestal(rng, seat.height(0, 0), radius, reach, casters=kind == "office")
    if kind == "plinth":
        return []
    low, high = (0.018, 0.035) if kind == "short" else (0.01, 0.027)
    style = LegStyle.random(rng, rng.uniform(low, high))
    stand = _stand(rng, kind, seat, style)
    floor = stand.foot["front"][1]
    bow = rng.uniform(-0.03, 0.05) if kind in ("four", "short") and chance(rng, 0.2) else 0.0
    parts = stand.leg("front", bow)
    if kind != "cantilever":
        parts += stand.leg("rear", bow * rng.uniform(0, 1.5))
    if kind in ("sled", "cantilever", "rocker"):
        parts += fu.runners(rng, stand, stand.foot["rear"][0], rocker=kind == "rocker")
    straight = abs(stand.foot["front"][0] - stand.top["front"][0]) < 0.05 and bow == 0
    bottom = seat.top - seat.thickness
    if kind == "four" and bow == 0 and chance(rng, 0.5):
        parts += fu.random_stretchers(rng, stand, floor, bottom)
    if kind in ("four", "sled") and straight and seat.thickness < 0.09 and chance(rng, 0.45):
        half = rng.uniform(0.015, 0.05)
        lowest = min(seat.height(p[0], p[2]) for p in stand.top.values()) - seat.thickness / 2
        y = lowest - half + 0.012
        heights = {"left": y, "front": y, "rear": y}
        parts += stand.rails("apron", heights, (half + 0.008, style.size * rng.uniform(0.4, 0.9)))
    return parts


def _stand(rng: np.random.Generator, kind: str, seat: Seat, style: LegStyle) -> Stand:
    flush = 1 - style.size / min(seat.half_width, seat.half_depth)
    inset = flush * seat.corner * (1.0 if chance(rng, 0.45) else rng.uniform(0.7, 1.0))
    floor = 0.0
    if kind in ("sled", "cantilever", "rocker"):
        floor = style.size
    foot, top = {}, {}
    spread = rng.uniform(0, 0.22) if chance(rng, 0.6) else 0.0
    height = seat.top - seat.thickness
    for end, sign in (("front", 1.0), ("rear", -1.0)):
        x = sign * inset * seat.half_depth
        z = inset * seat.half_width * seat.width_at(x)
        top[end] = np.array([x, seat.height(x, z), z])
        out_x = spread * rng.uniform(0, 1.2) * (1 if end == "front" else 1.3)
        foot[end] = np.array([x + sign * out_x * height, floor, z + 0.8 * spread * height])
    if kind == "scissor":
        foot["front"][0], foot["rear"][0] = (sign * seat.half_depth for sign in (1, -1))
        x_front, x_rear = 0.75 * seat.half_depth, -0.75 * seat.half_depth
        top["front"][0], top["rear"][0] = x_rear, x_front
        for end in top:
            z = 0.85 * seat.half_width * seat.width_at(-seat.half_depth) * seat.corner
            z -= 2 * style.size if end == "rear" else 0.0
            foot[end][2] = top[end][2] = z
            top[end][1] = seat.height(top[end][0], z)
    if kind in ("sled", "cantilever", "rocker"):
        foot["rear"][2] = foot["front"][2]
    return Stand(foot, top, style)


def _arms(rng: np.random.Generator, kind: str, seat: Seat, back: Back) -> list[Part]:
    if kind == "none":
        return []
    if kind == "sofa":
        return _sofa_arms(rng, seat, back)
    y = min(seat.top + rng.uniform(0.14, 0.27), back.bottom + 0.85 * back.height)
    x_rear, z_rear, _ = back.edge(y)
    half = rng.uniform(0.008, 0.025), rng.uniform(0.012, 0.04)
    x_front = seat.half_depth * rng.uniform(0.2, 1.05)
    z = max(seat.half_width * seat.width_at(0.0), z_rear) + half[1] * rng.uniform(-0.5, 1.5)
    rise = rng.uniform(-0.04, 0.04)
    turn = rng.uniform(0.1, 0.5)
    bend = rng.uniform(-0.03, 0.04)
    centre = (
        smooth([0, 0.5, 1], [y, y + bend, y + rise]),
        smooth([0, turn, 1], [z_rear, z, z - rng.uniform(0, 0.03)]),
    )
    e = float(rng.choice([2.0, 3.0, 8.0, 40.0]))
    widths = smooth([0, 0.4, 1], half[1] * rng.uniform(0.6, 1.2, 3))
    tip = rng.uniform(0, 0.15)
    section = Superellipse(half[0], rounded(widths, 0, tip, depth=0.8), e)
    parts = _both(Part("arm-right", 0, x_rear, x_front, section, centre=centre))
    below = seat.top - seat.thickness * rng.uniform(0.3, 0.8)
    z_seat = seat.half_width * seat.width_at(x_front)
    if kind == "panel":
        middle, half_length = (x_rear + x_front) / 2, (x_front - x_rear) / 2
        reach = Superellipse(half[1] * rng.uniform(0.3, 0.8), half_length * 0.95, 12.0)
        ends = linear([0, 1], [min(z, z_seat), z]), middle
        return [*parts, *_both(Part("arm-panel-right", 1, below, y, reach, centre=ends))]
    x_top = x_rear + (x_front - x_rear) * rng.uniform(0.65, 0.95)
    x_foot = x_top + rng.uniform(-0.1, 0.02)
    x_foot = float(np.clip(x_foot, -0.6 * seat.half_depth, 0.85 * seat.half_depth * seat.corner))
    z_foot = 0.95 * seat.half_width * seat.width_at(x_foot) * min(1, seat.corner + 0.15)
    thin = rng.uniform(0.007, 0.02), rng.uniform(0.007, 0.03)
    y_top = float(np.interp(x_top, [x_rear, x_front], [y, y + rise]))
    post = bar("arm-post-right", 1, (x_foot, below, z_foot), (x_top, y_top, z), thin, e)
    return [*parts, *_both(post)]


def _sofa_arms(rng: np.random.Generator, seat: Seat, back: Back) -> list[Part]:
    upper = min(seat.top + rng.uniform(0.1, 0.28), back.bottom + 0.9 * back.height)
    lower = seat.top - seat.thickness * rng.uniform(0.7, 1.02)
    half = rng.uniform(0.035, 0.12)
    x_rear = back.edge((upper + seat.top) / 2)[0]
    x_rear = min(x_rear, -seat.half_depth * rng.uniform(0.8, 1.05))
    x_front = seat.half_depth * rng.uniform(0.75, 1.03)
    slope = rng.uniform(-0.12, 0.05) if chance(rng, 0.5) else 0.0
    a = linear([0, 1], [(upper - lower) / 2, (upper - lower + slope) / 2])
    y = linear([0, 1], [(upper + lower) / 2, (upper + lower + slope) / 2])
    e = float(rng.choice([2.5, 4.0, 8.0, 30.0]))
    soft, depth = rng.uniform(0.02, 0.3), rng.uniform(0.05, 0.4)
    section = Superellipse(rounded(a, 0, soft, 2, depth), rounded(half, 0, soft, 2, depth), e)
    z = seat.half_width * seat.width_at(0.0) + half * rng.uniform(0.6, 0.98)
    flare = rng.uniform(0, 0.05)
    arm = Part("arm-right", 0, x_rear, x_front, section, centre=(y, linear([0, 1], [z, z + flare])))
    parts = _both(arm)
    if back.height > 0.45 and chance(rng, 0.45):
        top = back.bottom + back.height * rng.uniform(0.75, 0.95)
        foot = upper - 0.05
        if top <= foot:
            return parts  # arms as high as that leave no back for wings
        (x0, z0, thick), (x1, z1, _) = back.edge(foot), back.edge(top)
        reach = thick + rng.uniform(0.05, 0.2)
        length = smooth([0, 0.6, 1], reach * np.array([1, rng.uniform(0.7, 1.1), 0.6]) / 2)
        thin = rng.uniform(0.018, 0.045)
        section = Superellipse(thin, rounded(length, 0, 0.2, depth=0.5), 4.0)
        x = smooth(
            [0, 0.6, 1], [x0 + reach / 2, (0.4 * x0 + 0.6 * x1) + reach / 2, x1 + 0.3 * reach]
        )
        parts += _both(
            Part("wing-right", 1, foot, top, section, centre=(linear([0, 1], [z0, z1]), x))
        )
    return parts


class ChairFamily(Family):
    """Chairs of seven styles with a seat, a back, any of eight supports, with or without arms."""

    name = "chair"
    slots = (
        "seat",
        "back",
        *fu.LEG_SLOTS,
        *fu.STRETCHER_SLOTS,
        *fu.APRON_SLOTS,
        *fu.RUNNER_SLOTS,
        *fu.PEDESTAL_SLOTS,
        *fu.CASTER_SLOTS,
        *_ARM_SLOTS,
        *_WING_SLOTS,
    )
    region_names = (
        "seat",
        "seat-bottom",
        "back-front",
        "back-back",
        "back-top",
        "back-left",
        "back-right",
        *fu.LEG_SLOTS,
        "arm-left",
        "arm-right",
    )

    def build(self, rng: np.random.Generator) -> list[Part]:
        kind = pick(rng, {name: style.weight for name, style in STYLES.items()})
        style = STYLES[kind]
        support = pick(rng, style.supports)
        arms = pick(rng, style.arms)
        seat = random_seat(rng, style, kind, plinth=support == "plinth", boxy=arms == "sofa")
        back = random_back(rng, style, kind, seat)
        parts = [seat.part, back.part, *_support(rng, support, seat)]
        return parts + _arms(rng, arms, seat, back)

    def region_of(self, coordinates: SurfaceCoordinates) -> NDArray[np.str_]:
        c, slot = coordinates, self.slot
        eighth = np.floor((c.u * 8 + 1) % 8 / 2).astype(int)  # 0 +p, 1 +q, 2 -p, 3 -q
        out = np.full(len(c), "", dtype="<U16")
        out[(c.slot == slot("seat")) & (c.face == CAP_STOP)] = "seat"
        out[(c.slot == slot("seat")) & (c.face == CAP_START)] = "seat-bottom"
        back = c.slot == slot("back")
        names = np.array(["back-right", "back-front", "back-left", "back-back"])
        side = back & (c.face == SIDE)
        out[side] = names[eighth[side]]
        out[back & ((c.face == CAP_STOP) | (side & (eighth % 2 == 0) & (c.v > 0.95)))] = "back-top"
        for name in fu.LEG_SLOTS:
            out[c.slot == slot(name)] = name
        for name in ("arm-left", "arm-right"):
            out[(c.slot == slot(name)) & (c.face == SIDE) & (eighth == 0)] = name
        return out


FAMILY = ChairFamily()
