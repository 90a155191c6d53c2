"""What the tests of the verbs share: chairs, scans of chairs, and knowledge of a box."""

from __future__ import annotations

import numpy as np
import pytest

from builders.scenes import pose, scan_of
from builders.taught_box import SIZE, cloud, faces
from nrdf import cli
from nrdf.bundled import bundled_chair
from nrdf.io.cloud import PointCloud, write_cloud
from nrdf.shapes.families import get_family

SEED = 1_000_003
PLACE = pose(1.1, 850.0, (100, 2000, -30))


@pytest.fixture(scope="session")
def chair_files(tmp_path_factory):
    """A reference and two of its regions in metres; targets in millimetres, far away: target.ply,
    and other.ply, of which an untrained field puts nothing in the right place."""
    folder = tmp_path_factory.mktemp("files")
    reference, regions = bundled_chair("reference")
    write_cloud(folder / "reference.ply", reference)
    write_cloud(folder / "seat.ply", reference.select(regions["seat"]))
    np.savez(folder / "masks.npz", legs=regions["legs"])
    for name, chair in (("target", "rocker"), ("other", "armchair")):
        points = 1000 * bundled_chair(chair)[0].points + [5000.0, -300.0, 20.0]
        write_cloud(folder / f"{name}.ply", PointCloud(points, unit="mm", frame="cell"))
    return folder


@pytest.fixture
def retrieve(chair_files, untrained, tmp_path):
    """Run `nrdf retrieve` into tmp_path/deep/result with some options changed."""

    def run(**changes):
        options = {
            "model": [untrained],
            "reference": [chair_files / "reference.ply"],
            "region": [chair_files / "seat.ply", chair_files / "masks.npz"],
            "target": [chair_files / "target.ply"],
            "out": [tmp_path / "deep" / "result"],
            **changes,
        }
        words = ["retrieve"]
        for name, values in options.items():
            words += [f"--{name}", *map(str, values)]
        return cli.run(words)

    return run


@pytest.fixture(scope="session")
def scans(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scans")
    scan = scan_of("chair", SEED, PLACE, floor=True)
    write_cloud(folder / "scan.ply", scan.cloud)
    surface = get_family("chair").member(SEED).sample_surface(8192, np.random.default_rng(0))
    names = get_family("chair").region_of(surface.coordinates)
    write_cloud(folder / "ref.ply", PointCloud(surface.points, surface.normals))
    arms = get_family("chair").member(900_077).sample_surface(8192, np.random.default_rng(0))
    write_cloud(folder / "armchair.ply", PointCloud(arms.points, arms.normals))
    names_arms = get_family("chair").region_of(arms.coordinates)
    np.savez(folder / "arms.npz", **{n: names_arms == n for n in ("seat", "arm-left")})
    chosen = ("seat", "back-front", "leg-left-front")
    np.savez(folder / "regions.npz", **{n: names == n for n in chosen})
    floor = np.random.default_rng(0).uniform([-2, -2, 0], [2, 2, 1e-3], (3000, 3))
    write_cloud(folder / "floor.ply", PointCloud(floor))
    return folder


@pytest.fixture
def box_files(tmp_path):
    """box.ply, top.ply, front.ply, and new.ply in millimetres."""
    whole = cloud()
    write_cloud(tmp_path / "box.ply", whole)
    for name in ("top", "front"):
        write_cloud(tmp_path / f"{name}.ply", whole.select(faces(whole)[name]))
    other = cloud(SIZE, seed=1)
    write_cloud(tmp_path / "new.ply", PointCloud(1000 * other.points, other.normals, "mm", "cell"))
    return tmp_path


@pytest.fixture
def taught(box_files):
    words = f"teach --reference {box_files}/box.ply --category chair --region {box_files}/top.ply "
    words += f"{box_files}/front.ply --kind sand oil --out {box_files}/box.yaml"
    assert cli.run(words.split()) == 0
    return box_files
