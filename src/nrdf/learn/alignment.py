"""Objects of one kind in any heading, brought into one frame by each other.

One of them, the one most like all others whatever their headings, is the prototype. Each other one
is aligned with it by registration (`nrdf.scans.align`), and its mirror image is tried. Where most
files have one heading already, that is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from nrdf.field.registration import REGISTRATION
from nrdf.geometry.canonical import MIRROR, rotation_about_up
from nrdf.geometry.similarity import up_axis, upright
from nrdf.learn.objects import cloud_of, turned
from nrdf.regions.model import load_model
from nrdf.scans.align import align_scan
from nrdf.scans.mirror import mirror_plane
from nrdf.scans.pose_scorer import PoseScorer
from nrdf.shapes.correspond import choose_templates
from nrdf.shapes.dataset import Shape

UP = up_axis("y")
_AS_GIVEN = np.radians(15)
"""Yaws nearer to each other are one heading."""
_MOST = 0.6  # share of the files that makes their heading the one to keep
_MIRRORED = 0.15  # of cost that a mirror image must be better by
_ODD = 1.55  # cost from which an object is unlike the others (`PoseScorer`)
_PROTOTYPES = 3
_POOR = 1.05  # usual cost from which other axes are tried
_MUCH_BETTER = 0.15
_TRIED = 8  # objects
_SYMMETRIC = 0.5  # agreement from which a mirror plane is believed
_CELLS = 12  # of radii and of heights


@dataclass(frozen=True)
class AlignedObject:
    """shape: in the common frame. yaw: (rad) by which its file's heading differs from that frame;
    mirrored: whether it is the file's mirror image; cost: of the registration with the prototype.
    """

    shape: Shape
    yaw: float
    mirrored: bool
    cost: float


@dataclass(frozen=True)
class AlignedObjects:
    """objects: those that are alike, in the order given; odd: those that are not, which are left
    out. prototype: name of the object that the others were aligned with; as_given: whether the
    frame is the heading that most files have, so that +X is forward if it is in them."""

    objects: list[AlignedObject]
    odd: list[AlignedObject]
    prototype: str
    as_given: bool


def align_objects(
    shapes: Sequence[Shape],
    forward: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> AlignedObjects:
    """Bring shapes with +Y up into one frame; about 1 s each on one core.

    forward: name of a shape in whose file +X is forward; the heading that most files have unless
    given. `progress` is told (done, all).
    """
    tell = progress or (lambda *_: None)
    first = find_prototype(shapes)
    straight = _straightening(shapes[first])
    likely = [(np.array([straight]), 0.0) for _ in shapes]
    known = [turned(shapes[first], rotation_about_up(straight))]
    for number in range(len(shapes)):
        if number != first:
            likely[number] = _align(shapes[number], known)
        tell(number + 1, 2 * len(shapes))
    # Again, by several that are surely aligned, those that differ from the first.
    usual = float(np.median([cost for _, cost in likely]))
    sure = [n for n, (yaws, cost) in enumerate(likely) if cost <= usual and len(yaws) == 1]
    sure_shapes = [turned(shapes[n], rotation_about_up(likely[n][0][0])) for n in sure]
    chosen = choose_templates(sure_shapes, min(_PROTOTYPES, len(sure)))
    for number in range(len(shapes)):
        if number not in sure and len(sure) > 1:
            likely[number] = _align(shapes[number], [sure_shapes[n] for n in chosen])
        tell(len(shapes) + number + 1, 2 * len(shapes))
    named = [shape.name for shape in shapes].index(forward) if forward else None
    heading, as_given = _common_heading([yaws for yaws, _ in likely], named)
    aligned = []
    for shape, (yaws, cost) in zip(shapes, likely, strict=True):
        apart = _wrapped(yaws - heading)
        yaw = float(apart[np.abs(apart).argmin()] if as_given else apart[0])
        if as_given and abs(yaw) < _AS_GIVEN:
            yaw = 0.0  # the file's own heading is more exact than an alignment
        aligned.append(AlignedObject(shape, yaw, False, cost))
    in_frame = turned(shapes[first], rotation_about_up(aligned[first].yaw))
    judge = PoseScorer(load_model(REGISTRATION), [cloud_of(in_frame)])
    made = [_in_frame(one, judge) for one in aligned]
    odd = [one for one in made if one.cost > _ODD]
    kept = [one for one in made if one.cost <= _ODD]
    return AlignedObjects(kept, odd, shapes[first].name, as_given)


def better_axis(shapes: Sequence[Shape], aligned: AlignedObjects) -> str:
    """The axis ("x" or "z") about which shapes fit each other much better than about +Y, about
    which they were aligned; "" where there is none. An axis and its opposite are not told apart.
    """
    others = [one.cost for one in aligned.objects if one.shape.name != aligned.prototype]
    usual = float(np.median(others)) if others else 0.0
    if usual < _POOR:
        return ""
    some = list(shapes)[:: max(1, len(shapes) // _TRIED)][:_TRIED]
    costs = {"y": usual}
    for axis in ("x", "z"):
        seen = [turned(shape, upright(up_axis(axis))) for shape in some]
        first = find_prototype(seen)
        known = [turned(seen[first], rotation_about_up(_straightening(seen[first])))]
        found = [_align(shape, known)[1] for n, shape in enumerate(seen) if n != first]
        costs[axis] = float(np.median(found))
    best = min(costs, key=lambda axis: costs[axis])
    return best if best != "y" and costs[best] < usual - _MUCH_BETTER else ""


def _align(shape: Shape, known: Sequence[Shape]) -> tuple[np.ndarray, float]:
    """The likely yaws (k,), the likeliest first, and the least cost of a shape."""
    scorer = PoseScorer(load_model(REGISTRATION), [cloud_of(one) for one in known])
    found = align_scan(scorer, cloud_of(shape), UP).likely
    return np.array([one.yaw for one in found]), min(one.cost for one in found)


def find_prototype(shapes: Sequence[Shape]) -> int:
    """The number of the shape that is nearest to all others, seen without its heading: by how its
    surface is spread over heights and distances from the upright axis."""
    seen = np.array([_profile(shape.surface_points) for shape in shapes])
    apart = np.linalg.norm(seen[:, None] - seen[None], axis=-1)
    return int(apart.sum(axis=1).argmin())


def _profile(points: np.ndarray) -> np.ndarray:
    low, high = points.min(axis=0), points.max(axis=0)
    middle = (low + high) / 2
    radius = np.linalg.norm((points - middle)[:, [0, 2]], axis=1)
    height = points[:, 1] - low[1]
    counts = np.histogram2d(height, radius, _CELLS, [[0, 1], [0, 0.75]])[0]
    return np.sqrt(counts.ravel() / len(points))


def _straightening(shape: Shape) -> float:
    """The yaw (rad) of a shape's own mirror plane: across +Z where that is nearest."""
    points, normals = cloud_of(shape).points, cloud_of(shape).normals
    assert normals is not None
    found = [
        mirror_plane(points, normals, rotation_about_up(yaw)[:, 2])
        for yaw in np.pi / 12 * np.arange(-6, 6)
    ]
    best = max(found, key=lambda plane: plane.agreement - 0.02 * abs(plane.normal[0]))
    if best.agreement < _SYMMETRIC:
        return 0.0
    across = best.normal * (1.0 if best.normal[2] >= 0 else -1.0)
    return float(np.arctan2(across[0], across[2]))


def _common_heading(yaws: Sequence[np.ndarray], named: int | None) -> tuple[float, bool]:
    """The yaw of the object `named`, or the one that most objects have among their likely ones; and
    whether it is one of the files'."""
    if named is not None:
        return float(yaws[named][0]), True
    every = np.concatenate(yaws)
    holders = np.array(
        [sum(bool((np.abs(_wrapped(of - yaw)) < _AS_GIVEN).any()) for of in yaws) for yaw in every]
    )
    best = every[np.lexsort((np.abs(every), -holders))[0]]
    if holders.max() < _MOST * len(yaws):
        return 0.0, False  # the prototype's own mirror plane
    return float(best), True


def _in_frame(one: AlignedObject, judge: PoseScorer) -> AlignedObject:
    """The object in the common frame, as its mirror image where that is much more alike."""
    shape = turned(one.shape, rotation_about_up(one.yaw))
    image = turned(shape, np.diag(np.asarray(MIRROR, float)))
    costs = [judge.cost_of(judge.model.encode(cloud_of(seen))) for seen in (shape, image)]
    mirrored = costs[1] < costs[0] - _MIRRORED
    return replace(
        one, shape=image if mirrored else shape, mirrored=mirrored, cost=costs[int(mirrored)]
    )


def _wrapped(angle: np.ndarray) -> np.ndarray:
    """Angles (rad) between -π and π."""
    return np.arctan2(np.sin(angle), np.cos(angle))
