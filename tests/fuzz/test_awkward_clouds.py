"""Clouds that no object has, through every reader: empty, one point, NaN, absurd in size."""

from __future__ import annotations

import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from builders.fuzzing import outcome_of, tries
from nrdf.errors import CloudError
from nrdf.geometry.mesh import MAX_COORDINATE
from nrdf.io.cloud import PointCloud, check_cloud, read_cloud, write_cloud
from nrdf.io.inputs import as_cloud

VALUES = st.sampled_from([0.0, -0.0, 1.0, -1.0, 1e-300, 1e-30, 1e30, 1e160, -1e300, 1.7e308])
ODD = st.sampled_from([np.nan, np.inf, -np.inf, 5e-324])


def table(delimiter: str, heading: str = ""):
    def content(points: np.ndarray) -> bytes:
        file = io.StringIO()
        np.savetxt(file, points, delimiter=delimiter, header=heading, comments="")
        return file.getvalue().encode()

    return content


def npy(points: np.ndarray) -> bytes:
    file = io.BytesIO()
    np.save(file, points)
    return file.getvalue()


def npz(points: np.ndarray) -> bytes:
    file = io.BytesIO()
    np.savez_compressed(file, points=points)
    return file.getvalue()


def pcd(points: np.ndarray) -> bytes:
    head = "FIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\n"
    return f"{head}POINTS {len(points)}\nDATA binary\n".encode() + points.astype("<f8").tobytes()


def pcd_text(points: np.ndarray) -> bytes:
    return pcd(points[:0]).replace(b"binary", b"ascii").replace(
        b"POINTS 0", f"POINTS {len(points)}".encode()
    ) + table(" ")(points)


def obj(points: np.ndarray) -> bytes:
    return b"".join(b"v " + line + b"\n" for line in table(" ")(points).splitlines())


def off(points: np.ndarray) -> bytes:
    return f"OFF\n{len(points)} 0 0\n".encode() + table(" ")(points)


FORMATS = {
    "a.xyz": table(" "),
    "a.csv": table(",", "x,y,z"),
    "a.npy": npy,
    "a.npz": npz,
    "a.pcd": pcd,
    "text.pcd": pcd_text,
    "a.obj": obj,
    "a.off": off,
    "a.ply": None,
}


@pytest.fixture
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("awkward")


def read(folder, name, points):
    path = folder / name
    if name == "a.ply":
        write_cloud(path, PointCloud(points))
    else:
        path.write_bytes(FORMATS[name](points))
    return outcome_of(lambda: read_cloud(path))


CLOUDS = st.one_of(
    arrays(np.float64, st.tuples(st.integers(0, 5), st.just(3)), elements=VALUES),
    arrays(np.float64, st.tuples(st.integers(1, 5), st.just(3)), elements=st.one_of(VALUES, ODD)),
    st.tuples(st.integers(1, 300), ODD).map(lambda drawn: np.full((drawn[0], 3), drawn[1])),
)


@tries(400)
@given(CLOUDS, st.sampled_from(sorted(FORMATS)))
def test_awkward_clouds_are_read_as_they_are_or_refused(folder, points, name):
    outcome = read(folder, name, points)
    finite = np.isfinite(points).all(axis=1)
    if isinstance(outcome, CloudError):
        beyond = bool((np.abs(points[finite]) > MAX_COORDINATE).any())
        assert len(points) == 0 or not finite.all() or beyond, outcome
    else:
        assert finite.any() and np.abs(outcome.points).max() <= MAX_COORDINATE
        np.testing.assert_allclose(outcome.points, points[finite], rtol=1e-15, atol=0)
        outcome_of(lambda: check_cloud(outcome, 3))


@tries(100)
@given(CLOUDS)
def test_awkward_arrays_are_taken_or_refused(points):
    cloud = outcome_of(lambda: as_cloud(points))
    if not isinstance(cloud, CloudError):
        outcome_of(lambda: check_cloud(cloud, 1))


@tries(150)
@given(
    CLOUDS,
    arrays(np.int64, st.tuples(st.integers(0, 4), st.just(3)), elements=st.integers(-1, 5)),
    st.sampled_from(["a.obj", "a.off"]),
)
def test_awkward_meshes_are_sampled_or_refused(folder, points, faces, name):
    first = 1 if name == "a.obj" else 0
    rows = faces + first
    lines = [("f " if first else "3 ") + " ".join(map(str, row)) for row in rows.tolist()]
    content = FORMATS[name](points).replace(b" 0 0\n", f" {len(faces)} 0\n".encode(), 1)
    (folder / name).write_bytes(content + ("\n".join(lines) + "\n").encode())
    outcome = outcome_of(lambda: read_cloud(folder / name, mesh_samples=40))
    if not isinstance(outcome, CloudError):
        assert np.isfinite(outcome.points).all() and len(outcome) > 0
