"""How well the check of the kind of object tells: real objects of it, turned ones, and others.

The others are meshes of everyday objects of which training has seen none of the same name
(`nrdf.training.kind_network.is_held_out`). Definitions of the results: docs/evidence/scans.md.
"""

from __future__ import annotations

import logging
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.errors import DataError
from nrdf.field.cloud_encoder import WORKING_POINTS
from nrdf.field.kind_network import KindNetwork
from nrdf.geometry.canonical import canonical_transform
from nrdf.geometry.mesh import outer_skin
from nrdf.geometry.sampling import downsample
from nrdf.io.formats.mesh_file import load_mesh
from nrdf.scans.aligned_scan import clean_and_align
from nrdf.scans.kind_check import KindCheck, check_points
from nrdf.scans.pose_scorer import PoseScorer
from nrdf.shapes.prepare import find_meshes
from nrdf.training.kind_network import is_held_out
from nrdf_benchmark import scans
from nrdf_benchmark.bsrc.dataset import read_bsrc
from nrdf_benchmark.objects.dataset import read_objects

log = logging.getLogger(__name__)

OWN = {"chair": ("chair", "stool", "bench"), "car": (), "plane": ("glider",)}
"""Words in names of everyday objects that are of the category, or sat on as such: no others."""
LEAST_WARNED, MOST_WARNED, MOST_WARNED_SCANS = 0.95, 0.03, 0.05
"""At least so many of what is wrong must get a warning, at most so many of what is right, of which
scans brought in by alignment."""
VIEWS = "3 views"
FURNITURE = ("chair", "stool", "bench", "table", "desk")
"""Categories of labelled meshes that are shown as other kinds."""
OTHERS, PAIRS = "other objects", "two of the kind side by side"
BACKWARDS = "turned by 180° about Y"


@dataclass(frozen=True)
class KindResult:
    """One cloud that was checked. what: the row that it counts in; right: whether it is an object
    of the category, upright and facing +X; taken_for: what it looked like."""

    what: str
    name: str
    right: bool
    warned: bool
    taken_for: str
    probability: float


def real_objects(
    category: str, shapes: Path | None, bsrc: Path | None, labelled: Path | None
) -> Iterator[tuple[str, str, np.ndarray]]:
    """Source, name and points (n, 3) of objects of the category, upright and facing +X.

    shapes: folder of meshes with an index, whose test split is taken; bsrc: the benchmark's, its
    clouds as they are; labelled: labelled meshes, in folders named by category (`nrdf eval
    objects`). None leaves a source out. Raises DataError for a folder that is none of the kind.
    """
    if shapes is not None:
        for item in scans.meshes(shapes, category):
            yield "test meshes", item.name, item.points
    if bsrc is not None:
        for thing in read_bsrc(bsrc, category).objects:
            yield "BSRC", thing.name, thing.cloud.points
    if labelled is not None and (labelled / category).is_dir():
        for mesh in read_objects(labelled, [category]):
            yield "labelled meshes", mesh.key, _skin(mesh.key, mesh.vertices, mesh.faces)


def _skin(name: str, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Points (n, 3) of a mesh's outer skin."""
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    return outer_skin(vertices, faces, scans.CLOUD_POINTS, rng)[1].points


def other_objects(folder: Path, category: str, count: int, seed: int = 0) -> list[Path]:
    """`count` meshes, drawn by the seed, of those that no training saw and that are none of the
    category by their names. Raises DataError where there are fewer."""
    left_out = OWN.get(category, ())
    paths = [p for p in find_meshes(folder) if is_held_out(p.stem)]
    paths = [p for p in paths if not any(word in p.stem for word in left_out)]
    if len(paths) < count:
        raise DataError(f"{folder} holds {len(paths)} meshes of other kinds, not {count}")
    order = np.random.default_rng(seed).permutation(len(paths))
    return sorted(paths[i] for i in order[:count])


def turns() -> dict[str, list[np.ndarray]]:
    """Rotations (3, 3) by what they do: a quarter about any axis, back to front, upside down."""
    x, y, z = np.eye(3)
    return {
        "turned by ±90° about X or Z": [_about(a, s * 90) for a in (x, z) for s in (1, -1)],
        "turned by ±90° about Y": [_about(y, 90), _about(y, -90)],
        BACKWARDS: [_about(y, 180)],
        "upside down": [_about(x, 180), _about(z, 180)],
    }


def evaluate_kind(
    network: KindNetwork,
    category: str,
    right: list[tuple[str, str, np.ndarray]],
    others: list[Path],
    progress: Callable[[int, int], None] | None = None,
) -> list[KindResult]:
    """Check objects of the category (source, name, points), as they are and turned, and others."""
    results: list[KindResult] = []
    done, total = 0, len(right) + len(others)
    for source, name, points in right:
        results.append(_result(source, name, True, _check(network, category, points)))
        for what, rotations in turns().items():
            for rotation in rotations:
                said = _check(network, category, points @ rotation.T)
                results.append(_result(what, name, False, said))
        said = _check(network, category, _beside(points, right[done - 1][2]))
        results.append(_result(PAIRS, name, False, said))
        done += 1
        if progress is not None:
            progress(done, total)
    for path in others:
        try:
            points = _skin(path.stem, *load_mesh(path))
        except DataError as error:
            log.warning("left out: %s", error)
            continue
        said = _check(network, category, points)
        results.append(_result(OTHERS, path.stem, False, said))
        done += 1
        if progress is not None:
            progress(done, total)
    return results


def check_furniture(network: KindNetwork, category: str, labelled: Path) -> Iterator[KindResult]:
    """Furniture of other categories, of which some is sat on too: told apart, without a bar."""
    for kind in FURNITURE:
        if kind != category and (labelled / kind).is_dir():
            for mesh in read_objects(labelled, [kind]):
                said = _check(network, category, _skin(mesh.key, mesh.vertices, mesh.faces))
                yield _result(f"labelled meshes: {kind}", mesh.key, False, said)


def check_scans(scorer: PoseScorer, shapes: Path, every: int) -> Iterator[KindResult]:
    """Simulated scans of three views of every so manieth test mesh, brought in by alignment."""
    for number, item in enumerate(scans.meshes(shapes, scorer.model.category)):
        if number % every:
            continue
        rng = np.random.default_rng([zlib.crc32(item.name.encode()), scans.KINDS[VIEWS]])
        pose = scans.random_pose(rng)
        scan = scans.scan_item(item, VIEWS, pose, rng)
        assert scan is not None
        found = clean_and_align(scorer, scan.cloud, scans.UP)
        right = scans.pose_error(found, pose)[0] < 5
        what = f"scans of {VIEWS}, aligned" + ("" if right else " wrongly")
        yield _result(what, item.name, right, found.kind)


def summary(results: list[KindResult]) -> list[tuple[str, int, int, str]]:
    """Rows: what, how many of them were warned, of how many, and the bar, if there is one."""
    rows = []
    for right in (True, False):
        chosen = [f for f in results if f.right == right and not f.what.startswith("scans")]
        names = list(dict.fromkeys(f.what for f in chosen))
        for name in names:
            mine = [f for f in chosen if f.what == name]
            bar = f"≥ {LEAST_WARNED:.0%}" if name in (OTHERS, BACKWARDS) else ""
            rows.append((name, sum(f.warned for f in mine), len(mine), bar))
        if right:
            warned = sum(f.warned for f in chosen)
            rows.append(
                ("all real objects of the kind", warned, len(chosen), f"≤ {MOST_WARNED:.0%}")
            )
        else:
            turned = [f for f in chosen if f.what in turns()]
            warned = sum(f.warned for f in turned)
            rows.append(("all turned objects", warned, len(turned), f"≥ {LEAST_WARNED:.0%}"))
    for name in dict.fromkeys(f.what for f in results if f.what.startswith("scans")):
        mine = [f for f in results if f.what == name]
        bar = f"≤ {MOST_WARNED_SCANS:.0%}" if mine[0].right else ""
        rows.append((name, sum(f.warned for f in mine), len(mine), bar))
    return rows


def _check(network: KindNetwork, category: str, points: np.ndarray) -> KindCheck:
    """The check of a cloud (n, 3) in its own frame, as `Model.embed` would show it."""
    points = points[downsample(points, WORKING_POINTS, np.random.default_rng(0))]
    centre, scale = canonical_transform(points)
    return check_points(network, category, (points - centre) / scale, np.eye(3))


def _beside(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """The points of two objects on one floor, a tenth of their size apart along Z."""
    moved = two - two.min(axis=0) + one.min(axis=0)
    gap = 0.1 * float(np.ptp(one, axis=0).max())
    moved[:, 2] += np.ptp(one[:, 2]) + gap
    return np.concatenate([one, moved])


def _result(what: str, name: str, right: bool, said: KindCheck) -> KindResult:
    sure = float("nan") if said.probability is None else said.probability
    return KindResult(what, name, right, not said.fits, said.taken_for, sure)


def _about(axis: np.ndarray, degrees: float) -> np.ndarray:
    """The rotation (3, 3) about an axis (3,)."""
    return np.asarray(Rotation.from_rotvec(axis * degrees, degrees=True).as_matrix())
