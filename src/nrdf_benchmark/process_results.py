"""Film on real meshes: planned by the result, beside the taught plan at one feed.

A gun whose fan is as wide as the footprint that the benchmark's tool paths are planned for (50 mm
across furniture, 100 mm across cars), at 150 mm, and a target of 60 ± 6 µm. Its flow is such that
about 0.25 m/s give that. The taught plan has the best stepover of theory, and lines that run off by
the fan's half-width, as painters do.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from nrdf.errors import NrdfError
from nrdf.process_model.cells import plate
from nrdf.process_model.feed_planner import FeedLimits
from nrdf.process_model.plan import constant_feeds, plan_by_result
from nrdf.process_model.plate_theory import best_stepover, variation
from nrdf.process_model.result import ResultMetrics, Target
from nrdf.process_model.result_model import ResultModel
from nrdf.process_model.spray_profile import SprayProfile
from nrdf.surface.mesh_edges import edge_components
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.mesh_planner import plan_on_mesh
from nrdf.toolpath.region_samples import border_distance, sample_evenly
from nrdf.toolpath.strategy import Strategy
from nrdf_benchmark.mesh_paths.found_surface import regions_on
from nrdf_benchmark.mesh_paths.targets import TargetSource
from nrdf_benchmark.process_execution import Execution, execute_on_arm

TARGET = Target(60e-6, 6e-6)
STANDOFF_M, FEED_M_S = 0.15, 0.25
ROLES = ("seat", "back", "top", "bonnet", "roof", "all")
"""Names of the regions that are painted; "all" is a mesh that is one region."""
_UP, _FORWARD = np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])
_SHEETS_UP = np.array([0.0, 0.0, 1.0])  # of meshes that are one region
_FACING = 0.5  # least cosine to the side that is painted
_CURVED_RAD = np.radians(5.0)  # standard deviation of the normals' angle from their mean


@dataclass(frozen=True)
class RegionResult:
    """One region. faces: of it as given; cells: that its film is computed on; curved: whether it
    bends. seconds: CPU time of all but the taught lines. error: why there is none. executed: what
    the arm left of the plan, where that was asked for; arm_error: why it left nothing."""

    target: str
    region: str
    faces: int
    cells: int
    curved: bool
    planned: ResultMetrics | None
    taught: ResultMetrics | None
    seconds: float
    error: str = ""
    executed: Execution | None = None
    arm_error: str = ""


@dataclass(frozen=True)
class PlateResult:
    """A flat plate of 0.5 m. theory: variation of an endless plate at the best constant stepover;
    constant, planned: variation inside a margin of the fan's half-width."""

    stepover_m: float
    theory: float
    constant: float
    planned: float


def gun(radius_m: float) -> SprayProfile:
    """A gun with a round fan of that half-width."""
    flow = TARGET.value_m * 0.6 * radius_m * FEED_M_S
    return SprayProfile(radius_m, radius_m, flow, STANDOFF_M)


def taught_strategy(strategy: Strategy, profile: SprayProfile) -> Strategy:
    """The plan that is taught: even by theory, off the part by the fan's half-width."""
    return replace(
        strategy, stepover_m=best_stepover(profile), standoff_m=STANDOFF_M, line_order="snake",
        run_off_m=profile.ends_m[1],
    )  # fmt: skip


def evaluate_plate(radius_m: float = 0.05) -> PlateResult:
    """The flat plate."""
    profile = gun(radius_m)
    mesh = plate(0.5, 0.5, 0.02)
    region = RegionMesh.from_faces(mesh, np.ones(len(mesh.faces), bool))
    strategy = taught_strategy(Strategy(tool_radius_m=radius_m, spacing_m=0.01), profile)
    found = []
    lines = plan_on_mesh(region, strategy)
    before = ResultModel.of(region, lines, profile)
    planned = plan_by_result(region, lines, strategy, profile, TARGET, FeedLimits()).model
    for model, feeds in ((before, constant_feeds(before, TARGET, FeedLimits())), (planned, None)):
        film = model.values(feeds)
        inner = (np.abs(model.cells.centres[:, :2]) < 0.25 - radius_m).all(axis=1)
        share = model.cells.areas_m2[inner] / model.cells.areas_m2[inner].sum()
        mean = share @ film[inner]
        found.append(float(np.sqrt(share @ (film[inner] - mean) ** 2) / mean))
    stepover = best_stepover(profile)
    return PlateResult(stepover, variation(profile, stepover), found[0], found[1])


def evaluate_regions(
    sources: Sequence[TargetSource],
    whole: bool = False,
    arm: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> list[RegionResult]:
    """Every region of every mesh that the footprint fits into.

    whole: all of a labelled part, its edges and its far side too, instead of the side that is
    painted: the upper one of seats, tops, bonnets and roofs, the front of backs. arm: whether the
    simulated arm executes each plan too.
    """
    results = []
    for number, source in enumerate(sources):
        target = source.read()
        find = regions_on(target, "mesh")
        for name in target.visible_regions:
            if name not in ROLES:
                continue
            radius = target.strategy.tool_radius_m
            for side in _sides(find(name), name, whole):
                if fits(side, radius):
                    results.append(evaluate_region(side, target.name, name, target.strategy, arm))
        if progress is not None:
            progress(number + 1, len(sources))
    return results


def evaluate_region(
    region: RegionMesh, target: str, name: str, strategy: Strategy, arm: bool = False
) -> RegionResult:
    """One region, planned in both ways, and executed where an arm is asked for."""
    profile, limits = gun(strategy.tool_radius_m), FeedLimits()
    faces, curved = len(region.mesh.faces), is_curved(region)
    taught = taught_strategy(strategy, profile)
    try:
        lines = plan_on_mesh(region, taught)
        start = time.process_time()
        made = plan_by_result(region, lines, taught, profile, TARGET, limits)
        seconds = time.process_time() - start
    except NrdfError as error:
        return RegionResult(target, name, faces, 0, curved, None, None, 0.0, str(error))
    cells = len(made.model.cells.areas_m2)
    result = RegionResult(target, name, faces, cells, curved, made.metrics, made.taught, seconds)
    if not arm:
        return result
    up = _SHEETS_UP if name == "all" else _UP
    try:
        done = execute_on_arm(
            region, made, profile, TARGET, up, _FORWARD, strategy.tool_radius_m
        )  # fmt: skip
    except NrdfError as error:
        return replace(result, arm_error=str(error))
    return replace(result, executed=done)


def _sides(region: RegionMesh, name: str, whole: bool) -> Iterator[RegionMesh]:
    if whole or name == "all":
        yield region
        return
    facing = region.mesh.face_normals @ (_FORWARD if name == "back" else _UP) > _FACING
    if not facing.any():
        return
    part = region.mesh.submesh(facing)
    number = edge_components(part.faces)
    largest = int(np.bincount(number, part.face_areas).argmax())
    yield RegionMesh(part.submesh(number == largest), region.parent)


def fits(region: RegionMesh, radius_m: float) -> bool:
    """Whether a disc of that radius lies on the region somewhere."""
    if region.area_m2 < np.pi * radius_m**2:
        return False
    points, faces = sample_evenly(region.mesh, radius_m / 4.0)
    normals = region.mesh.face_normals[faces]
    away = border_distance(region.mesh, points, normals, radius_m)
    return bool(away.max() >= 0.95 * radius_m)


def is_curved(region: RegionMesh) -> bool:
    """Whether normals turn away from their mean by more than 5°, in the square mean."""
    share = region.mesh.face_areas / region.mesh.face_areas.sum()
    mean = share @ region.mesh.face_normals
    cosine = region.mesh.face_normals @ (mean / max(float(np.linalg.norm(mean)), 1e-12))
    angle = np.arccos(np.clip(cosine, -1.0, 1.0))
    return bool(np.sqrt(share @ angle**2) > _CURVED_RAD)


def summary(results: Sequence[RegionResult]) -> list[tuple[str, ...]]:
    """Rows of the table: what, bar, share of regions that meet it, median and worst, the taught
    plan's median."""
    pairs = [(r.planned, r.taught) for r in results if r.planned and r.taught]
    bent = [(r.planned, r.taught) for r in results if r.planned and r.taught and r.curved]
    quick = np.array([r.seconds * 1e4 / max(r.cells, 1e4) for r in results if r.planned])
    within = np.array([100 * p.within for p, _ in pairs])
    before = np.array([100 * t.within for _, t in pairs])
    even = np.array([p.variation / t.variation for p, t in bent])
    spill = np.array([p.overspray / t.overspray for p, t in pairs])
    arm = np.array([100 * r.executed.metrics.within for r in results if r.executed])
    rows = [
        _row("area within ± 10 %, %", ">= 95", within, within >= 95.0, within.min, before),
        _row("variation, of the taught plan's, curved", "<= 0.5", even, even <= 0.5, even.max),
        _row("overspray, of the taught plan's", "<= 0.8", spill, spill <= 0.8, spill.max),
        _row("seconds for 10,000 cells", "<= 3", quick, quick <= 3.0, quick.max),
        _row("area executed within ± 10 %, %", ">= 95", arm, arm >= 95.0, arm.min),
    ]  # fmt: skip
    return [row for row in rows if row]


def _row(
    name: str, bar: str, values: np.ndarray, met: np.ndarray, worst: Callable[[], float],
    taught: np.ndarray | None = None,
) -> tuple[str, ...]:  # fmt: skip
    if not len(values):
        return ()
    before = "" if taught is None else f"{np.median(taught):.1f}"
    return (name, bar, f"{met.mean():.0%} of {len(met)}", f"{np.median(values):.2f}",
            f"{worst():.2f}", before)  # fmt: skip
