"""A folder laid out and named like the Benchmark for Surface Region Correspondence."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from nrdf.io.cloud import PointCloud, write_cloud
from nrdf.shapes.families import SurfaceCoordinates, get_family
from nrdf_benchmark.bsrc.dataset import FOLDERS, ROIS

DEV_HALF = Path(__file__).parents[3] / "shared" / "bsrc"
NO_DEV_HALF = (
    "the public BSRC data are not there: get the Benchmark for Surface Region Correspondence from "
    f"the authors of NRDF and put objects 1, 3, 5, 7, 9 of Chair, Car and plane into {DEV_HALF}"
)


def dev_half() -> Path | None:
    """The development half of the public benchmark, where it is at hand."""
    return DEV_HALF if DEV_HALF.is_dir() else None


def member_clouds(category: str, seeds, count: int = 900):
    """For each seed a member's points (n, 3) and its 8 regions' indices, which correspond.

    A region is what lies nearest to one of 8 places of the family; members with the same seed are
    identical.
    """
    family = get_family(category)
    places = anchors(category)
    clouds = []
    for seed in seeds:
        member = family.member(seed)
        points = member.sample_surface(count, np.random.default_rng(seed)).points
        centres = member.locate(places).points
        distance = np.linalg.norm(points[:, None] - centres, axis=2)
        clouds.append((points, [np.argsort(column)[:60] for column in distance.T]))
    return clouds


def anchors(category: str) -> SurfaceCoordinates:
    """8 places that the first members of a family all have, far apart on member 0."""
    family = get_family(category)
    members = [family.member(seed) for seed in range(4)]
    pool = members[0].sample_surface(600, np.random.default_rng(0))
    there = np.all([member.locate(pool.coordinates).exists for member in members], axis=0)
    points, chosen = pool.points, [int(np.flatnonzero(there)[0])]
    while len(chosen) < 8:
        distance = np.linalg.norm(points[:, None] - points[chosen], axis=2).min(1)
        chosen.append(int(np.where(there, distance, -1).argmax()))
    return pool.coordinates[np.array(chosen)]


def write_bsrc(root: Path, category: str, clouds) -> Path:
    """Write (points, regions) as objects 1, 2, ... of a category; the folder `root`."""
    for number, (points, regions) in enumerate(clouds, 1):
        place = root / FOLDERS[category] / f"{category}{number}"
        place.mkdir(parents=True)
        write_cloud(place / "obj_pcd.ply", PointCloud(points))
        for roi, indices in zip(ROIS[category], regions, strict=True):
            write_cloud(place / f"cropped_{roi}.ply", PointCloud(points[indices]))
    return root
