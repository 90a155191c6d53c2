"""Scans with known truth: how well poses are found, and regions on what was seen.

Objects are members of the parametric families that training has not seen, and meshes where there
are any; cameras are simulated (`nrdf.scans.simulate`). Definitions of the results:
docs/evidence/scans.md.
"""

from __future__ import annotations

import csv
import time
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nrdf.errors import DataError
from nrdf.geometry.canonical import canonical_transform, rotation_about_up
from nrdf.geometry.mesh import outer_skin
from nrdf.geometry.similarity import Similarity, up_axis, upright
from nrdf.io.cloud import PointCloud
from nrdf.io.formats.mesh_file import load_mesh
from nrdf.regions.match import Match
from nrdf.regions.presence import ABSENT
from nrdf.regions.reference import EncodedReference
from nrdf.scans.aligned_scan import AlignedScan, clean_and_align
from nrdf.scans.pose_scorer import PoseScorer
from nrdf.scans.simulate import ScanSettings, SimulatedScan, simulate_scan
from nrdf.shapes.families import Family, get_family
from nrdf.shapes.families.tessellation import Tessellation, tessellate
from nrdf_benchmark.metrics import MISSED, chamfer_l1

FIRST_SEED = 1_100_000
"""Members from this seed on are neither trained on, nor were any thresholds chosen on them."""
CLOUD_POINTS = 8192
NOISE = 0.001 / 0.9  # of depth, on objects whose longest side is 1: 1 mm on a 0.9 m object
KINDS = {"full": 0, "3 views": 3, "1 view": 1}
"""Cameras of each kind of scan; 0 is the full surface."""
LEAST = 20  # points of the surface, of 8192, from which a region counts as there
SHARED = 0.5  # share of its points that the target has, likewise; engines may be elsewhere
SEEN, UNSEEN = 0.3, 0.02
"""Share of a region's due points in a scan, from which it was seen, and below which it was not."""
UP = up_axis("z")


@dataclass(frozen=True)
class KnownObject:
    """An object whose truth is known: vertices (v, 3) and faces (f, 3), canonical, and points
    (8192, 3) of its full surface."""

    name: str
    source: str
    vertices: np.ndarray
    faces: np.ndarray
    points: np.ndarray


@dataclass(frozen=True)
class PoseResult:
    """One scan's alignment. yaw: error in degrees, of the whole rotation; scale: relative error;
    warned: the report said that the pose is ambiguous, rough or a poor fit; seconds, processor
    seconds: of cleaning and alignment; points: of the scan."""

    kind: str
    source: str
    name: str
    yaw: float
    scale: float
    warned: bool
    seconds: float
    processor_seconds: float
    points: int


@dataclass(frozen=True)
class RegionResult:
    """One region on one target. kind: "canonical", or one of `KINDS`; state: "there", "absent" or
    "hidden" in truth; reason: what was reported; cd_l1: canonical, of what was found from what is
    true and was seen, `MISSED` where nothing was found, NaN where there was nothing to find; iou:
    of the points found and true, likewise; evidence: of absence (`nrdf.regions.presence`)."""

    kind: str
    pair: int
    region: str
    state: str
    reason: str
    found: int
    cd_l1: float
    iou: float
    evidence: tuple[float, ...]


def members(category: str, count: int) -> Iterator[KnownObject]:
    """Unseen members of a family."""
    family = get_family(category)
    for seed in range(FIRST_SEED, FIRST_SEED + count):
        member = family.member(seed)
        mesh = tessellate(member)
        surface = member.sample_surface(CLOUD_POINTS, np.random.default_rng(seed))
        yield KnownObject(str(seed), "family", mesh.vertices, mesh.faces, surface.points)


def meshes(folder: Path, category: str, split: str = "test") -> Iterator[KnownObject]:
    """The meshes of a split that `index.csv` in `folder` lists (category, shape, split).

    They lie in folder/category/shape.*; +X forward, +Y up. Raises DataError if the index or a mesh
    is missing or cannot be read.
    """
    try:
        with open(folder / "index.csv", newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DataError(f"cannot read {folder / 'index.csv'} ({error})") from error
    for row in rows:
        if row.get("category") != category or row.get("split") != split:
            continue
        name = row.get("shape") or row.get("name") or ""
        paths = sorted((folder / category).glob(f"{name}.*"))
        if not name or not paths:
            raise DataError(
                f"{folder}: index.csv lists '{name}', but {category}/{name}.* is not there"
            )
        vertices, faces = load_mesh(paths[0])
        centre, scale = canonical_transform(vertices)
        vertices = (vertices - centre) / scale
        rng = np.random.default_rng(zlib.crc32(name.encode()))
        skin = outer_skin(vertices, faces, CLOUD_POINTS, rng)[1]
        yield KnownObject(name, "mesh", vertices, faces, skin.points)


def random_pose(rng: np.random.Generator) -> Similarity:
    """Any yaw, z up; scale 0.1 to 1000, log-uniform; offset of up to ten scales."""
    scale = float(10 ** rng.uniform(-1, 3))
    turn = upright(UP) @ rotation_about_up(rng.uniform(0, 2 * np.pi))
    return Similarity(turn, scale * rng.uniform(-10, 10, 3), scale)


def scan_item(
    item: KnownObject, kind: str, pose: Similarity, rng: np.random.Generator
) -> SimulatedScan | None:
    """A simulated scan of that kind, with a floor; None of the full surface."""
    views = KINDS[kind]
    if not views:
        return None
    settings = ScanSettings(views=views, noise=NOISE, quantisation=NOISE / 2, floor=True)
    return simulate_scan(item.vertices, item.faces, settings, rng, pose)


def score_pose(scorer: PoseScorer, item: KnownObject, kind: str) -> PoseResult:
    """Scan an item, align it, and compare with the truth; its own random numbers."""
    rng = np.random.default_rng([zlib.crc32(item.name.encode()), KINDS[kind]])
    pose = random_pose(rng)
    scan = scan_item(item, kind, pose, rng)
    cloud = PointCloud(pose.to_scan(item.points)) if scan is None else scan.cloud
    start, processor = time.perf_counter(), time.process_time()
    found = clean_and_align(scorer, cloud, UP)
    seconds, processor = time.perf_counter() - start, time.process_time() - processor
    yaw, scale = pose_error(found, pose)
    return PoseResult(
        kind,
        item.source,
        item.name,
        yaw,
        scale,
        has_pose_warning(found),
        seconds,
        processor,
        len(cloud),
    )


def has_pose_warning(found: AlignedScan) -> bool:
    """Whether the pose is reported as ambiguous, rough or a poor fit."""
    alignment = found.alignment
    return alignment.is_ambiguous or alignment.best.symmetry == 0 or not found.kind.fits


def pose_error(found: AlignedScan, true: Similarity) -> tuple[float, float]:
    """Angle (degrees) between the rotations, and the relative error of scale."""
    pose = found.alignment.best.pose
    cosine = (np.trace(pose.rotation.T @ true.rotation) - 1) / 2
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1)))), abs(pose.scale / true.scale - 1)


def score_regions(
    scorer: PoseScorer,
    category: str,
    pair: int,
    first_seed: int = FIRST_SEED,
    drop_absent: bool = True,
) -> list[RegionResult]:
    """Every region of one member, found on another: canonical, and in scans of each kind.

    The members of pair i have the seeds first_seed + 2 i and the next. drop_absent: as of
    `EncodedReference.retrieve_all`.
    """
    family = get_family(category)
    rng = np.random.default_rng([first_seed, pair])
    reference = family.member(first_seed + 2 * pair)
    target = family.member(first_seed + 2 * pair + 1)
    reference_surface = reference.sample_surface(CLOUD_POINTS, rng)
    surface = target.sample_surface(CLOUD_POINTS, rng)
    mesh = tessellate(target)
    item = KnownObject(str(pair), "family", mesh.vertices, mesh.faces, surface.points)
    names, true = (
        family.region_of(reference_surface.coordinates),
        family.region_of(surface.coordinates),
    )
    regions = {r: names == r for r in family.region_names if (names == r).sum() >= LEAST}
    share = {r: float((true == r).mean()) for r in regions}
    exists = target.locate(reference_surface.coordinates).exists
    shared = {r for r, mask in regions.items() if exists[mask].mean() >= SHARED}
    regions = {r: mask for r, mask in regions.items() if r in shared or share[r] == 0}
    encoded = scorer.model.encode(PointCloud(reference_surface.points, reference_surface.normals))
    encoded_reference = EncodedReference(scorer.model, encoded)
    matches = encoded_reference.retrieve_all(
        regions, PointCloud(surface.points), drop_absent=drop_absent
    )
    results = _compare("canonical", pair, matches, surface.points, true, share)
    for kind in KINDS:
        pose = random_pose(rng)
        scan = scan_item(item, kind, pose, rng)
        if scan is None:
            cloud, seen, shape = PointCloud(pose.to_scan(surface.points)), true, surface.points
        else:
            cloud, shape = scan.cloud, pose.to_canonical(scan.cloud.points)
            seen = _labels(family, mesh, scan)
        found = clean_and_align(scorer, cloud, UP)
        matches = encoded_reference.retrieve_all(regions, found.encode(), drop_absent=drop_absent)
        matches = {name: match.in_scan(found) for name, match in matches.items()}
        results += _compare(kind, pair, matches, shape, seen, share)
    return results


def _labels(family: Family, mesh: Tessellation, scan: SimulatedScan) -> np.ndarray:
    """The region that each point of a scan is in, "" for none and "floor" for the floor: (n,)."""
    coordinates = mesh.at(np.maximum(scan.face, 0), scan.second, scan.third)
    return np.where(scan.face < 0, "floor", family.region_of(coordinates))


def _compare(
    kind: str,
    pair: int,
    matches: dict[str, Match],
    points: np.ndarray,
    labels: np.ndarray,
    share: dict[str, float],
) -> list[RegionResult]:
    """Matches against the labels (n,) of points (n, 3), canonical; share: of each region in the
    full surface."""
    of_object = int((labels != "floor").sum())
    results = []
    for name, match in matches.items():
        true = points[labels == name]
        due = share[name] * of_object
        state = ""
        if share[name] == 0:
            state = "absent"
        elif share[name] * CLOUD_POINTS >= LEAST and len(true) >= max(SEEN * due, LEAST):
            state = "there"
        elif len(true) <= UNSEEN * due:
            state = "hidden"
        cd = iou = float("nan")
        if state == "there":
            found = points[match.indices]
            cd = chamfer_l1(found, true) if len(found) else MISSED
            common = int((labels[match.indices] == name).sum())
            iou = common / (len(found) + len(true) - common)
        if state:
            said = match.presence
            evidence = tuple(said.evidence or ())
            found_points = len(match.indices)
            results.append(
                RegionResult(kind, pair, name, state, said.reason, found_points, cd, iou, evidence)
            )
    return results


def summary(
    poses: list[PoseResult], regions: list[RegionResult]
) -> list[tuple[str, str, float, int]]:
    """Rows: kind, what, value, of how many."""
    rows: list[tuple[str, str, float, int]] = []

    def add(kind: str, what: str, values: list[float]) -> None:
        if values:
            rows.append((kind, what, float(np.mean(values)), len(values)))

    for kind in KINDS:
        for source in ("family", "mesh"):
            mine = [p for p in poses if p.kind == kind and p.source == source]
            add(kind, f"{source}: yaw within 5°", [p.yaw < 5 for p in mine])
            add(kind, f"{source}: scale within 2 %", [p.scale < 0.02 for p in mine])
        mine = [p for p in poses if p.kind == kind]
        add(kind, "wrong poses with a warning", [p.warned for p in mine if p.yaw >= 5])
        add(kind, "right poses with a warning", [p.warned for p in mine if p.yaw < 5])
        add(kind, "seconds", [p.seconds for p in mine])
        add(kind, "seconds of processor time", [p.processor_seconds for p in mine])
    canonical = {(r.pair, r.region): r.cd_l1 for r in regions if r.kind == "canonical"}
    for kind in ("canonical", *KINDS):
        there, absent, hidden = (
            [r for r in regions if r.kind == kind and r.state == state]
            for state in ("there", "absent", "hidden")
        )
        add(kind, "CD-L1", [r.cd_l1 for r in there])
        if kind != "canonical":
            add(kind, "the same regions canonical", [canonical[r.pair, r.region] for r in there])
        add(kind, "CD-L1 of those found", [r.cd_l1 for r in there if r.found])
        add(kind, "there, reported absent", [r.reason == ABSENT for r in there])
        add(kind, "there, found nowhere", [not r.found for r in there])
        add(kind, "absent, reported absent", [r.reason == ABSENT for r in absent])
        add(kind, "absent, returned empty", [not r.found for r in absent])
        add(kind, "not seen, returned empty", [not r.found for r in hidden])
    return rows


def evaluate_scans(
    scorer: PoseScorer,
    items: Callable[[], Iterator[KnownObject]],
    count: int,
    pairs: int,
    progress: Callable[[int, int], None],
) -> tuple[list[PoseResult], list[RegionResult]]:
    """Poses of `count` items in each kind of scan, and regions of `pairs` pairs of members."""
    total, done = count + pairs, 0
    poses: list[PoseResult] = []
    regions: list[RegionResult] = []
    for item in items():
        poses += [score_pose(scorer, item, kind) for kind in KINDS]
        progress(done := done + 1, total)
    for pair in range(pairs):
        regions += score_regions(scorer, scorer.model.category, pair)
        progress(done := done + 1, total)
    return poses, regions
