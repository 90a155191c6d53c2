"""What chairs and tables share: bars, legs, stretchers, runners, pedestals. Lengths in metres."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nrdf.shapes.families.base import Part, rotation
from nrdf.shapes.families.sections import Curve, Knots, Superellipse, linear, rounded, smooth

SIDES = ("left", "right")
ENDS = ("front", "rear")
LEG_SLOTS = tuple(f"leg-{side}-{end}" for side in SIDES for end in ENDS)
STRETCHER_SLOTS = tuple(f"stretcher-{where}" for where in (*SIDES, *ENDS, "middle"))
APRON_SLOTS = tuple(f"apron-{where}" for where in (*SIDES, *ENDS))
RUNNER_SLOTS = tuple(f"runner-{where}" for where in (*SIDES, *ENDS))
STAR = 6
PEDESTAL_SLOTS = ("column", "base", *(f"star-{i}" for i in range(STAR)))
CASTER_SLOTS = tuple(f"caster-{i}" for i in range(STAR))


def chance(rng: np.random.Generator, probability: float) -> bool:
    """True with that probability."""
    return bool(rng.random() < probability)


def pick(rng: np.random.Generator, weights: dict[str, float]) -> str:
    """One of the names, by weight."""
    values = np.array(list(weights.values()))
    return list(weights)[rng.choice(len(values), p=values / values.sum())]


def bar(
    slot: str,
    axis: int,
    start: Knots,
    stop: Knots,
    half: tuple[Curve, Curve],
    e: float = 12.0,
) -> Part:
    """A straight bar between two points; start[axis] < stop[axis]; half-widths along (p, q)."""
    p, q = (axis + 1) % 3, (axis + 2) % 3
    centre = linear([0, 1], [start[p], stop[p]]), linear([0, 1], [start[q], stop[q]])
    return Part(slot, axis, start[axis], stop[axis], Superellipse(*half, e), centre=centre)


@dataclass(frozen=True)
class LegStyle:
    """A leg's section along its height (s = 0 at the floor): half-widths along (z, x)."""

    half: tuple[Curve, Curve]
    e: float
    size: float

    @staticmethod
    def random(rng: np.random.Generator, size: float) -> LegStyle:
        """Straight, tapered, turned or flat, square or round; `size` is the half-width on top."""
        kind = pick(rng, {"straight": 4, "taper": 4, "turned": 1.5, "flat": 1.5})
        e = float(rng.choice([2.0, 4.0, 8.0, 40.0], p=[0.35, 0.15, 0.2, 0.3]))
        if kind == "straight":
            return LegStyle((size, size * rng.uniform(0.8, 1.25)), e, size)
        if kind == "flat":
            thin = size * rng.uniform(0.45, 0.7)
            half = (thin, 1.7 * size) if chance(rng, 0.6) else (1.7 * size, thin)
            return LegStyle(half, 8.0, size)
        if kind == "taper":
            curve = linear([0, 1], [size * rng.uniform(0.4, 0.8), size])
            return LegStyle((curve, curve), e, size)
        knots = np.linspace(0, 1, 9)
        radii = size * np.r_[rng.uniform(0.5, 1.3, 7), 1.2, 1.2]
        radii[0] *= 0.7
        turned = smooth(knots, radii)
        return LegStyle((turned, turned), 2.0, size)


@dataclass(frozen=True)
class Stand:
    """Four legs, mirrored in z = 0. Corners are (x, y, z) on the right side, by end."""

    foot: dict[str, np.ndarray]
    top: dict[str, np.ndarray]
    style: LegStyle

    def leg(self, end: str, bow: float = 0.0) -> list[Part]:
        """The right and left leg; `bow` (m) swings its middle outward (front) or back (rear)."""
        foot, top = self.foot[end], self.top[end]
        sign = 1 if end == "front" else -1
        x = smooth([0, 0.5, 1], [foot[0], (foot[0] + top[0]) / 2 - sign * bow, top[0]])
        z = linear([0, 1], [foot[2], top[2]])
        if bow == 0:
            x = linear([0, 1], [foot[0], top[0]])
        right = Part(
            f"leg-right-{end}",
            1,
            foot[1],
            top[1],
            Superellipse(*self.style.half, self.style.e),
            centre=(z, x),
        )
        return [right, right.mirrored(f"leg-left-{end}")]

    def at_height(self, end: str, y: float) -> np.ndarray:
        """The right leg's centre at height y."""
        foot, top = self.foot[end], self.top[end]
        return foot + (top - foot) * (y - foot[1]) / (top[1] - foot[1])

    def rails(
        self,
        kind: str,
        heights: dict[str, float],
        half: tuple[float, float],
        e: float = 12.0,
    ) -> list[Part]:
        """Bars between the legs, slots `kind`-left, ... ; heights by left (both sides), front,
        rear, middle; half-widths (vertical, horizontal).
        """
        parts = []
        for where, y in heights.items():
            front, rear = self.at_height("front", y), self.at_height("rear", y)
            if where == "left":
                low, high = sorted([rear, front], key=lambda corner: corner[0])
                right = bar(f"{kind}-right", 0, low, high, half, e)
                parts += [right, right.mirrored(f"{kind}-left")]
            else:
                corner = {"front": front, "rear": rear, "middle": (front + rear) / 2}[where]
                ends = corner * np.array([1, 1, -1]), corner
                parts.append(bar(f"{kind}-{where}", 2, *ends, half[::-1], e))
        return parts


def random_stretchers(
    rng: np.random.Generator, stand: Stand, floor: float, top: float
) -> list[Part]:
    """Sides only, H, box or front-and-rear stretchers, somewhere between floor and top."""
    height = top - floor
    side = floor + height * rng.uniform(0.15, 0.5)
    other = floor + height * rng.uniform(0.12, 0.6)
    heights = {
        "sides": {"left": side},
        "h": {"left": side, "middle": side},
        "box": {"left": side, "front": other, "rear": side},
        "ends": {"front": other, "rear": other},
    }[pick(rng, {"sides": 1, "h": 1.5, "box": 2, "ends": 0.7})]
    size = stand.style.size * rng.uniform(0.35, 0.7)
    half = size * rng.uniform(1, 1.8), size
    return stand.rails("stretcher", heights, half, float(rng.choice([2.0, 12.0, 40.0])))


def runners(
    rng: np.random.Generator, stand: Stand, rear_reach: float, rocker: bool = False
) -> list[Part]:
    """Bars on the floor along x under the legs; with cross bars or bent up as rockers."""
    size = stand.style.size * rng.uniform(0.8, 1.2)
    front, rear = stand.foot["front"], stand.foot["rear"]
    x0, x1 = min(rear[0], rear_reach) - size, front[0] + size
    y, z = front[1], (front[2], rear[2])
    e = float(rng.choice([2.0, 12.0, 40.0]))
    if rocker:
        x0, x1 = x0 - 0.15, x1 + 0.08
        rise = rng.uniform(0.3, 0.6)
        middle = (front[0] + rear[0]) / 2
        half_base = (front[0] - rear[0]) / 2

        def height(s: np.ndarray) -> np.ndarray:
            x = x0 + (x1 - x0) * s - middle
            return y + rise * (x * x - half_base**2)

        centre: tuple[Curve, Curve] = (height, linear([0, 1], [z[1], z[0]]))
    else:
        centre = (y, linear([0, 1], [z[1], z[0]]))
    right = Part("runner-right", 0, x0, x1, Superellipse(size, size, e), centre=centre)
    parts = [right, right.mirrored("runner-left")]
    if not rocker:
        for end, x, wide in (("front", x1 - size, z[0]), ("rear", x0 + size, z[1])):
            if end == "rear" or chance(rng, 0.3):
                ends = (x, y, -wide), (x, y, wide)
                parts.append(bar(f"runner-{end}", 2, *ends, (size, size), e))
    return parts


def pedestal(
    rng: np.random.Generator, top: float, radius: float, reach: float, casters: bool
) -> list[Part]:
    """A column from the floor to `top` on a disc or a star of `reach` (m)."""
    thick = rng.uniform(0.012, 0.05)
    low = 0.06 if casters else 0.0
    star = casters or chance(rng, 0.5)
    profile: Callable[[float], Curve] = lambda r: r  # noqa: E731
    kind = pick(rng, {"straight": 2, "taper": 2, "step": 1.5, "turned": 1})
    if kind == "taper":
        profile = lambda r: smooth([0, 0.4, 1], [1.7 * r, r, 0.9 * r])  # noqa: E731
    elif kind == "step":
        profile = lambda r: linear([0, 0.5, 0.51, 1], [1.4 * r, 1.4 * r, 0.8 * r, 0.8 * r])  # noqa: E731
    elif kind == "turned":
        factors = rng.uniform(0.7, 1.7, 8)
        profile = lambda r: smooth(np.linspace(0, 1, 8), r * factors)  # noqa: E731
    e = float(rng.choice([2.0, 2.0, 2.0, 12.0]))
    column = profile(radius)
    parts = [Part("column", 1, low, top, Superellipse(column, column, e))]
    if not star:
        thick = rng.uniform(0.012, 0.05)
        outline = rounded(reach, 0.0, rng.uniform(0.3, 0.9), depth=rng.uniform(0.05, 0.7))
        shape = Superellipse(outline, outline, float(rng.choice([2.0, 2.0, 2.0, 5.0, 12.0])))
        return [*parts, Part("base", 1, 0.0, thick, shape)]
    count = int(rng.choice([3, 4, 5, 6], p=[0.12, 0.33, 0.5, 0.05]))
    turn = rng.uniform(0, 2 * np.pi / count) if chance(rng, 0.3) else 0.0
    rise = rng.uniform(0.0, 0.1)
    half = rng.uniform(0.012, 0.025), rng.uniform(0.012, 0.028)
    y = low + half[0]
    for i in range(count):
        around = rotation(1, turn + 2 * np.pi * i / count)
        arm = Part(
            f"star-{i}",
            0,
            0.3 * radius,
            reach,
            Superellipse(
                linear([0, 1], [half[0] * 1.3, half[0]]),
                linear([0, 1], [1.3 * half[1], half[1]]),
                6,
            ),
            centre=(smooth([0, 1], [y + rise, y]), 0.0),
        )
        parts.append(arm.mapped(around))
        if casters:
            wheel = rounded(0.03, 0.3, 0.3, depth=0.4)
            caster = Part(
                f"caster-{i}", 2, -0.022, 0.022, Superellipse(wheel, wheel), (reach - 0.02, 0.03)
            )
            parts.append(caster.mapped(around))
    return parts
