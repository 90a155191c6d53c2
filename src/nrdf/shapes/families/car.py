"""Cars: bodies from city cars to vans and coupés, with wheels and small parts. Unit: metres.

One lofted body (see `bodywork`) whose coordinates run from bonnet to boot and from roof to floor,
so that a place on one car is the same place on every other; wheels, mirrors, bumpers, spoiler and
roof rails are parts of their own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from nrdf.shapes.families.base import (
    CAP_START,
    CAP_STOP,
    SIDE,
    Array,
    Part,
    SurfaceCoordinates,
    Warp,
    rotation,
)
from nrdf.shapes.families.bodywork import (
    BELT_U,
    FLOOR_U,
    SHOULDER_U,
    SIDE_V,
    TOP_V,
    Bodywork,
    End,
    Well,
    filleted,
    shrinking,
)
from nrdf.shapes.families.car_styles import random_style
from nrdf.shapes.families.member import Family
from nrdf.shapes.families.sections import Superellipse, linear, rounded
from nrdf.shapes.families.vehicle import blob, dish, semantic_station


class CarFamily(Family):
    """Sedans, hatchbacks, estates, coupés, sports cars, SUVs, vans and pickups."""

    name = "car"
    slots = (
        "body",
        "wheel-front-left", "wheel-front-right", "wheel-rear-left", "wheel-rear-right",
        "mirror-left", "mirror-right",
        "bumper-front", "bumper-rear",
        "spoiler", "spoiler-strut-left", "spoiler-strut-right",
        "rail-left", "rail-right",
        "spare-wheel",
    )  # fmt: skip
    region_names = (
        "bonnet", "windscreen", "roof", "rear-window", "boot", "left-side", "right-side",
        "front-end", "rear-end", "underside", "wheels",
    )  # fmt: skip

    def build(self, rng: np.random.Generator) -> list[Part]:
        d = random_style(rng)
        body, work, bow = _body(d, rng)
        parts = [body, *_wheels(d, work, bow, rng)]
        if rng.random() < 0.65:
            parts += _mirrors(d, work, bow, rng)
        if rng.random() < 0.12:
            parts += _bumpers(d, work, bow, rng)
        if rng.random() < 0.2:
            parts += _spoiler(d, work, rng)
        if d["upright"] and d["height"] > 1.5 and rng.random() < 0.4:
            parts += _rails(d, work, rng)
        if d["upright"] and d["roof_end"] > 0.85 and rng.random() < 0.15:
            parts.append(_spare(d, rng))
        return parts

    def region_of(self, coordinates: SurfaceCoordinates) -> NDArray[np.str_]:
        out = np.full(len(coordinates), "", dtype="<U12")
        slot, face, v = coordinates.slot, coordinates.face, coordinates.v
        u = coordinates.u - np.floor(coordinates.u)
        fold = np.minimum(u, 1 - u)
        body, side = slot == self.slot("body"), face == SIDE
        top = body & side & (fold < SHOULDER_U)
        names = ("rear-end", "boot", "rear-window", "roof", "windscreen", "bonnet", "front-end")
        for name, low, high in zip(names, TOP_V[:-1], TOP_V[1:], strict=True):
            out[top & (v >= low) & (v <= high)] = name
        flank = body & side & ~top
        out[flank] = np.where(u[flank] < 0.5, "right-side", "left-side")
        out[flank & (fold > FLOOR_U)] = "underside"
        out[(flank & (v < SIDE_V[1] / 2)) | (body & (face == CAP_START))] = "rear-end"
        out[(flank & (v > (1 + SIDE_V[-2]) / 2)) | (body & (face == CAP_STOP))] = "front-end"
        out[(slot >= self.slot("wheel-front-left")) & (slot <= self.slot("wheel-rear-right"))] = (
            "wheels"
        )
        out[slot == self.slot("bumper-front")] = "front-end"
        out[slot == self.slot("bumper-rear")] = "rear-end"
        return out


def _body(d: Mapping[str, float], rng: np.random.Generator) -> tuple[Part, Bodywork, Warp]:
    length, soft = d["length"], d["round"]
    front, rear = 1 - d["front_axle"], 1 - d["rear_axle"]
    stations = 1 - np.array(
        [1.0, *(d[k] for k in ("boot_edge", "window_base", "roof_end")),
         *(d[k] for k in ("screen_top", "screen_base", "bonnet_edge")), 0.0]
    )  # fmt: skip
    tail, boot_edge, base, end, top, screen, edge, nose = stations
    middle = 0.55 * top + 0.45 * end
    hood = 0.5 * (screen + edge)
    bow = (0.01 + 0.05 * soft) * rng.uniform(0.5, 1.3)
    roof_front = d["height"] - rng.uniform(0.02, 0.06)
    profile = filleted(
        [tail, boot_edge, base, end, middle, top, screen, hood, edge, nose],
        [
            d["tail_y"] - 0.06 - 0.1 * soft, d["tail_y"], d["boot_y"],
            d["height"] - d["roof_drop"], d["height"], roof_front,
            d["screen_y"], 0.5 * (d["screen_y"] + d["bonnet_y"]) + bow, d["bonnet_y"],
            d["nose_y"],
        ],
        [0.02, 0.03, 0.015 + 0.05 * soft, 0.2, 0.03 + 0.06 * soft, 0.015 + 0.03 * soft,
         0.2, 0.02 + 0.06 * soft],
    )  # fmt: skip
    ends = _ends(d, rng)
    width = filleted(
        [0.0, 0.22, 0.7, 1.0],
        np.array([rng.uniform(0.88, 0.97), 1.0, 1.0, rng.uniform(0.84, 0.96)]) * d["width"] / 2,
        [0.15, 0.2],
    )
    ride = d["ride"]
    bottom = filleted(
        [0.0, max(rear - 0.08, 0.05), min(front + 0.08, 0.95), 1.0],
        [ride + rng.uniform(0.05, 0.16), ride, ride, ride + rng.uniform(0.0, 0.12)],
        [0.05, 0.05],
    )
    middle_y = 0.5 * (ride + 0.9 * d["bonnet_y"])
    crown = linear(
        [0.0, boot_edge, base, 0.5 * (base + end), end, top, 0.5 * (top + screen), screen, edge, 1],
        (0.6 + 0.6 * soft) * np.array([0.10, 0.08, 0.10, 0.16, 0.12, 0.11, 0.17, 0.12, 0.13, 0.12]),
    )
    wheel = d["wheel"]
    depth = 0.0 if rng.random() < 0.4 else rng.uniform(0.08, 0.2)
    flare = rng.uniform(0.0, 0.05)
    wells = tuple(
        Well(x * length, wheel, wheel * rng.uniform(1.08, 1.2), depth, flare) for x in (rear, front)
    )
    belt = d["screen_y"] - rng.uniform(0.0, 0.06)
    work = Bodywork(
        length=length,
        centre=middle_y,
        bottom=shrinking(bottom, middle_y, ends[0], ends[1]),
        top=shrinking(profile, middle_y, ends[0], ends[1]),
        width=shrinking(width, 0.0, ends[2], ends[3]),
        belt=linear([0, 1], [belt + rng.uniform(-0.02, 0.06), belt - rng.uniform(0.0, 0.06)]),
        tumblehome=d["tumblehome"],
        curvature=rng.uniform(0.0, 0.25),
        crown=crown,
        crown_e=rng.uniform(2.1, 2.5) + 1.6 * (1 - soft),
        floor=rng.uniform(0.06, 0.16),
        floor_e=rng.uniform(2.0, 3.0),
        barrel=rng.uniform(0.05, 0.3),
        waist=rng.uniform(0.55, 0.75) * d["bonnet_y"] / 0.8,
        wells=wells,
        edge=rng.uniform(0.02, 0.05),
    )
    radius = [w.radius / length for w in wells]
    side = [0, rear - radius[0], rear, rear + radius[0], front - radius[1], front,
            front + radius[1], 1]  # fmt: skip
    plan = rng.uniform(0.02, 0.07) * (0.5 + soft)
    tilt = rng.uniform(0.0, 0.05)
    warp = Warp(
        0,
        scale=lambda y, z: 1 - plan * z**2 - tilt * (y - middle_y) ** 2 / 2,
        anchor=0.5 * length,
    )
    body = Part(
        "body", 0, 0.0, length, work, centre=(middle_y, 0.0),
        maps=(warp,),
        station=semantic_station(
            (TOP_V, stations), (SIDE_V, side), (SHOULDER_U, BELT_U + 0.04)
        ),
    )  # fmt: skip
    return body, work, warp


def _ends(d: Mapping[str, float], rng: np.random.Generator) -> tuple[End, End, End, End]:
    """Rounding of tail and nose: in the profile, then in the plan."""
    soft = d["round"]
    return (
        End(rng.uniform(0.01, 0.025) + 0.01 * soft, rng.uniform(0.55, 0.8), 2.2),
        End(rng.uniform(0.02, 0.04) + 0.02 * soft, rng.uniform(0.45, 0.75), 2.2),
        End(rng.uniform(0.02, 0.06) + 0.05 * soft, rng.uniform(0.75, 0.9), 2.2),
        End(rng.uniform(0.03, 0.08) + 0.08 * soft, rng.uniform(0.65, 0.88), 2.2),
    )


def _half_width(work: Bodywork, x: float, y: float) -> float:
    """Half the body's width at (x, y) as if it had no wheel arches; 0 outside the profile."""
    plain = replace(work, wells=tuple(replace(w, depth=0.0) for w in work.wells))
    return max(float(plain.breadth(np.array([y]), np.array([x / work.length]))[0]), 0.0)


def _roof_height(work: Bodywork, s: Array, z: float) -> Array:
    """Height of the body's upper side at the stations s (n,), at the distance z from the middle."""
    y = work.curves(s)[1][:, None] - np.linspace(0, 0.3, 301)
    wide = work.breadth(y.ravel(), np.repeat(s, 301)).reshape(y.shape) >= z
    return y[np.arange(len(s)), wide.argmax(1)]


def _place(bow: Warp, point: Sequence[float]) -> Array:
    return bow.forward(np.asarray(point, float)[None])[0]


def _wheels(
    d: Mapping[str, float], work: Bodywork, bow: Warp, rng: np.random.Generator
) -> list[Part]:
    radius = d["wheel"]
    breadth = rng.uniform(0.18, 0.26)
    proud = rng.uniform(-0.03, 0.03)
    shoulder, blunt = rng.uniform(0.1, 0.3), rng.uniform(2.0, 4.0)
    hollow = rng.uniform(-0.02, 0.03)
    parts = []
    for name, well in (("rear", work.wells[0]), ("front", work.wells[1])):
        outer = _half_width(work, well.x, 1.4 * radius) + proud
        breadth_here = max(breadth, well.depth + 0.04)
        inner = outer - breadth_here
        x = _place(bow, (well.x, radius, outer))[0]
        right = Part(
            f"wheel-{name}-right",
            2,
            inner,
            outer,
            Superellipse(
                rounded(radius, 0.0, shoulder, blunt), rounded(radius, 0.0, shoulder, blunt)
            ),
            centre=(float(x), radius),
            maps=(dish(2, inner, outer, (float(x), radius), 0.6 * radius, hollow),),
        )
        parts += [right, right.mirrored(f"wheel-{name}-left")]
    return parts


def _mirrors(
    d: Mapping[str, float], work: Bodywork, bow: Warp, rng: np.random.Generator
) -> list[Part]:
    station = 1 - d["screen_base"] - rng.uniform(0.1, 0.45) * (d["screen_top"] - d["screen_base"])
    y = d["screen_y"] + rng.uniform(0.0, 0.06)
    root = _half_width(work, station * d["length"], y)
    if root < 0.3:
        return []
    x = float(_place(bow, (station * d["length"], y, root))[0])
    reach = rng.uniform(0.12, 0.24)
    half = rng.uniform(0.05, 0.09), rng.uniform(0.06, 0.09)
    right = blob("mirror-right", 2, root - 0.08, root + reach, half, (x, y), ends=(0.0, 0.5))
    return [right, right.mirrored("mirror-left")]


def _bumpers(
    d: Mapping[str, float], work: Bodywork, bow: Warp, rng: np.random.Generator
) -> list[Part]:
    height, depth = rng.uniform(0.05, 0.1), rng.uniform(0.08, 0.14)
    y = work.centre + rng.uniform(-0.12, 0.0)
    half = d["width"] / 2 * rng.uniform(0.9, 1.0)
    square = rng.uniform(3, 8)
    parts = []
    for slot, x in (("bumper-rear", 0.0), ("bumper-front", d["length"])):
        bar = blob(slot, 2, -half, half, (depth, height), (x, y), square, (0.08, 0.08))
        parts.append(bar.mapped(bow))
    return parts


def _spoiler(d: Mapping[str, float], work: Bodywork, rng: np.random.Generator) -> list[Part]:
    length = d["length"]
    chord = rng.uniform(0.1, 0.2)
    half = d["width"] / 2 * rng.uniform(0.6, 0.95)
    if d["roof_end"] > 0.82:  # at the rear edge of a roof
        edge = (1 - d["roof_end"]) * length + 0.03
        y = float(work.curves(np.array([edge / length]))[1][0]) - 0.02
        half = min(half, 0.9 * _half_width(work, edge, y - 0.04))
        if half < 0.3:
            return []
        x = edge - 0.3 * chord
        return [blob("spoiler", 2, -half, half, (chord, 0.03), (x, y), 3.0, (0.15, 0.15))]
    x = (1 - d["boot_edge"]) * length + chord
    deck = float(work.curves(np.array([x / length]))[1][0])
    lift = rng.choice([0.02, rng.uniform(0.12, 0.35)])
    y = deck + lift
    blade = blob("spoiler", 2, -half, half, (chord, 0.025), (x, y), 2.5, (0.05, 0.05))
    parts = [blade.mapped(rotation(2, rng.uniform(-0.2, 0.05), (x, y, 0)))]
    if lift > 0.1:
        z = half * rng.uniform(0.5, 0.8)
        strut = Part(
            "spoiler-strut-right", 1, deck - 0.15, y, Superellipse(0.02, 0.5 * chord, 4.0),
            centre=(z, x),
        )  # fmt: skip
        parts += [strut, strut.mirrored("spoiler-strut-left")]
    return parts


def _rails(d: Mapping[str, float], work: Bodywork, rng: np.random.Generator) -> list[Part]:
    start = (1 - d["roof_end"]) * d["length"] + 0.1
    stop = (1 - d["screen_top"]) * d["length"] - 0.1
    if stop - start < 0.6:
        return []
    s = np.asarray(np.linspace(start, stop, 9) / d["length"], np.float64)
    z = 0.72 * _half_width(work, 0.5 * (start + stop), d["height"] - 0.13)
    height = _roof_height(work, s, z) + 0.02
    rail = Part(
        "rail-right", 0, start, stop,
        Superellipse(rounded(rng.uniform(0.03, 0.05), 0.08, 0.08), 0.02, 3.0),
        centre=(linear(np.linspace(0, 1, 9).tolist(), height.tolist()), z),
    )  # fmt: skip
    return [rail, rail.mirrored("rail-left")]


def _spare(d: Mapping[str, float], rng: np.random.Generator) -> Part:
    radius = 0.9 * d["wheel"]
    y = 0.5 * (d["ride"] + d["screen_y"]) + 0.15
    section = Superellipse(rounded(radius, 0.3, 0.0, 2.5), rounded(radius, 0.3, 0.0, 2.5))
    return Part("spare-wheel", 0, -rng.uniform(0.12, 0.2), 0.15, section, centre=(y, 0.0))


FAMILY = CarFamily()
