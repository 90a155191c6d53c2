"""Tool paths planned on known regions: families' own, and the benchmark's as labelled.

Clouds are scaled to `SIZE_M` on their longest side. Only planning is measured: no region is
retrieved.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.errors import DataError
from nrdf.geometry.canonical import canonical_transform
from nrdf.geometry.sampling import indices_in_subset
from nrdf.shapes.families import get_family
from nrdf.shapes.families.member import Member
from nrdf.surface.border import OWN
from nrdf.surface.patch import Patch, patches_of
from nrdf.surface.surface import Surface, surface_subset
from nrdf.toolpath.metrics import ToolPathMetrics, measure_path
from nrdf.toolpath.planner import plan
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.types import Segment
from nrdf_benchmark.bsrc.dataset import read_bsrc
from nrdf_benchmark.families import CLOUD_POINTS, FIRST_SEED

SIZE_M = 0.9
STRATEGY = Strategy(stepover_m=0.025, spacing_m=0.01, tool_radius_m=0.025)
"""A sanding pad of 50 mm, its lines half of it apart."""
SMALLEST_REGION = 20  # points
NEAR_M = 1e-3

Exact = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Which of positions (n, 3), m, with outward normals (n, 3), lie within `NEAR_M` of the surface."""


@dataclass(frozen=True)
class PlanningObject:
    """An object to plan on. points: (n, 3), m; normals: (n, 3); regions: name to indices (k,);
    exact: the surface itself, where it is known."""

    name: str
    points: np.ndarray
    normals: np.ndarray
    regions: dict[str, np.ndarray]
    exact: Exact | None = None


@dataclass(frozen=True)
class PathResult:
    """One region's tool path. width_m: diameter of the largest disc inside the region; bend_rad:
    angle between a point's normal and the smooth one that the tool feels, the 95th percentile;
    near: share of the process waypoints within `NEAR_M` of the exact surface, None where that is
    not known; seconds: CPU time."""

    object: str
    region: str
    width_m: float
    bend_rad: float
    metrics: ToolPathMetrics
    near: float | None
    seconds: float

    @property
    def wide(self) -> bool:
        """Whether the tool's footprint fits: the region is no rim, and no thinner rod."""
        return self.width_m >= 2.0 * STRATEGY.tool_radius_m and self.bend_rad <= np.pi / 4


def family_members(category: str, members: int) -> Iterator[PlanningObject]:
    """Members that no training set holds, with their exact regions, one cloud each."""
    if members < 1:
        raise DataError(f"{members} members asked for; give at least 1")
    family = get_family(category)
    for seed in range(FIRST_SEED, FIRST_SEED + members):
        member = family.member(seed)
        sample = member.sample_surface(CLOUD_POINTS, np.random.default_rng(seed))
        named = family.region_of(sample.coordinates)
        regions = {name: np.flatnonzero(named == name) for name in family.region_names}
        regions = {name: found for name, found in regions.items() if len(found) >= SMALLEST_REGION}
        exact = partial(_near_member, member)
        yield PlanningObject(str(seed), SIZE_M * sample.points, sample.normals, regions, exact)


def _near_member(member: Member, positions: np.ndarray, normals: np.ndarray) -> np.ndarray:
    inside, outside = (
        member.occupancy((positions + side * NEAR_M * normals) / SIZE_M) for side in (-1.0, 1.0)
    )
    return inside & ~outside


def bsrc_objects(folder: Path, category: str) -> Iterator[PlanningObject]:
    """The benchmark's objects, with their regions as labelled."""
    for item in read_bsrc(folder, category, "corrected").objects:
        points = SIZE_M / canonical_transform(item.cloud.points)[1] * item.cloud.points
        assert item.cloud.normals is not None  # read_bsrc estimates them
        yield PlanningObject(item.name, points, item.cloud.normals, item.truth)


def evaluate_toolpaths(
    objects: Iterable[PlanningObject],
    strategy: Strategy = STRATEGY,
    progress: Callable[[int], None] | None = None,
) -> list[PathResult]:
    """Plan on every region of every object and measure the paths.

    `progress` is told the number of objects done.
    """
    results = []
    for number, item in enumerate(objects):
        start = time.process_time()
        kept = surface_subset(item.points, item.normals)
        surface = Surface(item.points[kept], item.normals[kept])
        surface.edges  # noqa: B018, what regions share
        shared = (time.process_time() - start) / len(item.regions)
        for name, indices in item.regions.items():
            region = indices_in_subset(kept, indices, len(item.points))
            start = time.process_time()
            segments = plan(surface, region, strategy)
            seconds = shared + time.process_time() - start
            metrics = measure_path(surface, region, strategy, segments)
            width, bend = _shape(patches_of(surface, region))
            near = None if item.exact is None else _near(item.exact, segments, strategy)
            results.append(PathResult(item.name, name, width, bend, metrics, near, seconds))
        if progress is not None:
            progress(number + 1)
    return results


def _shape(patches: Sequence[Patch]) -> tuple[float, float]:
    """`width_m` and `bend_rad` of a region."""
    cosines = []
    for patch in patches:
        own = patch.label == OWN
        smooth = patch.smooth_normals(patch.uv[own], STRATEGY.tool_radius_m)
        cosines.append(np.einsum("na,na->n", smooth, patch.normals[own]))
    bend = float(np.arccos(np.clip(np.quantile(np.concatenate(cosines), 0.05), -1.0, 1.0)))
    return 2.0 * max(patch.border.deepest for patch in patches), bend


def _near(exact: Exact, segments: Iterable[Segment], strategy: Strategy) -> float:
    work = [segment for segment in segments if segment.kind == "process"]
    held = Rotation.from_quat(np.concatenate([s.quaternions_xyzw for s in work])).as_matrix()
    axes = held[:, :, 2]
    positions = np.concatenate([s.positions for s in work]) + strategy.standoff_m * axes
    return float(exact(positions, -axes).mean())


@dataclass(frozen=True)
class PathMetric:
    """A metric of all results: what it is, the bar in words, its values (n,), and which of them
    meet the bar (n,)."""

    name: str
    bar: str
    values: np.ndarray
    met: np.ndarray
    lowest_is_worst: bool = False

    @property
    def worst(self) -> float:
        return float(self.values.min() if self.lowest_is_worst else self.values.max())


def summarize(results: list[PathResult], strategy: Strategy = STRATEGY) -> list[PathMetric]:
    """The metrics that tool paths are held to, of those results that have them."""
    made = [
        _metric(
            "coverage of what is not left out, %", ">= 99",
            [_covered(r.metrics) for r in results], 99.0, True,
        ),
        _metric(
            "worst line spacing, stepovers", "<= 1.15",
            [
                r.metrics.line_spacing_worst_m / strategy.stepover_m
                for r in results
                if r.metrics.line_spacing_worst_m is not None
            ],
            1.15,
        ),
        _metric(
            "distance from smooth surface (99 %), mm", "<= 1",
            [1e3 * r.metrics.surface_distance_99_m for r in results], 1.0,
        ),
        _metric(
            "tool axis (99 %), degrees", "<= 5",
            [float(np.degrees(r.metrics.axis_error_99_rad)) for r in results], 5.0,
        ),
        _metric(
            "largest step between waypoints, spacings", "<= 2",
            [r.metrics.step_worst_m / strategy.spacing_m for r in results], 2.0,
        ),
        _metric(
            "largest turn between waypoints, degrees", "<= 30",
            [float(np.degrees(r.metrics.turn_worst_rad)) for r in results], 30.0,
        ),
    ]  # fmt: skip
    near = [100.0 * r.near for r in results if r.near is not None]
    if near:
        made.append(_metric("within 1 mm of exact surface, %", "", near, 99.0, True))
    return [metric for metric in made if len(metric.values)]


def _covered(metrics: ToolPathMetrics) -> float:
    """The share, in per cent, of what is to be worked that is worked."""
    wanted = metrics.coverage + metrics.unreached
    return 100.0 * metrics.coverage / wanted if wanted > 0.0 else 0.0


def _metric(
    name: str, bar: str, values: list[float], limit: float, lowest_is_worst: bool = False
) -> PathMetric:
    found = np.array(values)
    return PathMetric(
        name, bar, found, found >= limit if lowest_is_worst else found <= limit, lowest_is_worst
    )
