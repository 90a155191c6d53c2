"""Tool paths planned on known regions: families' own, and the benchmark's as labelled.

Planned as `nrdf transfer` does: a mesh is made of the cloud, and the regions' points vote. Clouds
are scaled to `SIZE_M` on their longest side. No region is retrieved.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.errors import DataError
from nrdf.geometry.canonical import canonical_transform
from nrdf.geometry.frames import angles_between
from nrdf.io.cloud import PointCloud
from nrdf.shapes.families import get_family
from nrdf.shapes.families.member import Member
from nrdf.surface.given_surface import given_surface
from nrdf.surface.object_mesh import object_mesh
from nrdf.surface.region_mesh import RegionMesh, region_meshes
from nrdf.toolpath.mesh_planner import plan_on_mesh
from nrdf.toolpath.metrics import ToolPathMetrics, measure_path
from nrdf.toolpath.region_samples import border_distance, sample_evenly
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
    not known; metrics: None where the region is smaller than the tool and has no path; seconds: CPU
    time."""

    object: str
    region: str
    width_m: float
    bend_rad: float
    metrics: ToolPathMetrics | None
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
        cloud = PointCloud(item.points, item.normals, unit="m")
        mesh = object_mesh(cloud, strategy.tool_radius_m)
        memberships = {name: np.zeros(len(item.points)) for name in item.regions}
        for name, indices in item.regions.items():
            memberships[name][indices] = 1.0
        radii = dict.fromkeys(memberships, strategy.tool_radius_m)
        meshes = region_meshes(mesh, item.points, item.normals, memberships, radii)
        given = given_surface(cloud)
        shared = (time.process_time() - start) / len(item.regions)
        for name in item.regions:
            if name not in meshes.found:
                results.append(PathResult(item.name, name, 0.0, 0.0, None, None, shared))
                continue
            region = meshes.found[name]
            start = time.process_time()
            segments = plan_on_mesh(region, strategy)
            seconds = shared + time.process_time() - start
            metrics = measure_path(region, strategy, segments, given)
            width, bend = _shape(region, strategy)
            near = None if item.exact is None else _near(item.exact, segments, strategy)
            results.append(PathResult(item.name, name, width, bend, metrics, near, seconds))
        if progress is not None:
            progress(number + 1)
    return results


def _shape(region: RegionMesh, strategy: Strategy) -> tuple[float, float]:
    """`width_m` and `bend_rad` of a region; a part without a border is infinitely wide."""
    mesh, radius = region.mesh, strategy.tool_radius_m
    points, faces = sample_evenly(mesh, radius / 4.0)
    smooth = mesh.smooth_normals(points, faces, radius)
    bend = float(np.quantile(angles_between(smooth, mesh.face_normals[faces]), 0.95))
    return 2.0 * float(border_distance(mesh, points, mesh.face_normals[faces], radius).max()), bend


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
    figures = [result.metrics for result in results if result.metrics is not None]
    made = [
        _metric(
            "regions with a tool path, %", ">= 100",
            [100.0 * (result.metrics is not None) for result in results], 100.0, True,
        ),
        _metric(
            "coverage of what is not left out, %", ">= 99",
            [_covered(m) for m in figures], 99.0, True,
        ),
        _metric(
            "worst line spacing, stepovers", "<= 1.15",
            [
                m.line_spacing_worst_m / strategy.stepover_m
                for m in figures
                if m.line_spacing_worst_m is not None
            ],
            1.15,
        ),
        _metric(
            "distance from the cloud's surface (99 %), mm", "<= 1",
            [1e3 * (m.true_distance_99_m or 0.0) for m in figures], 1.0,
        ),
        _metric(
            "tool axis (99 %), degrees", "<= 5",
            [float(np.degrees(m.axis_error_99_rad)) for m in figures], 5.0,
        ),
        _metric(
            "largest step between waypoints, spacings", "<= 2",
            [m.step_worst_m / strategy.spacing_m for m in figures], 2.0,
        ),
        _metric(
            "largest turn between waypoints, degrees", "<= 30",
            [float(np.degrees(m.turn_worst_rad)) for m in figures], 30.0,
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
