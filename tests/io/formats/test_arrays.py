"""NumPy's files."""

from __future__ import annotations

import numpy as np
import pytest

from builders.cloud_files import NORMALS, POINTS, check_refused
from nrdf.errors import CloudError
from nrdf.io.cloud import read_cloud


def test_numpy_files_give_points_and_normals(tmp_path):
    np.save(tmp_path / "a.npy", POINTS.astype(np.float32))
    np.save(tmp_path / "b.npy", np.hstack([POINTS, NORMALS]))
    np.savez(tmp_path / "c.npz", points=POINTS, normals=2 * NORMALS)
    np.savez(tmp_path / "d.npz", **{"pointcloud/points": POINTS, "pointcloud/normals": NORMALS})
    for name in ("a.npy", "b.npy", "c.npz", "d.npz"):
        cloud = read_cloud(tmp_path / name)
        np.testing.assert_allclose(cloud.points, POINTS, rtol=1e-6)
        if name != "a.npy":
            np.testing.assert_allclose(cloud.normals, NORMALS)


def test_npz_without_points_lists_what_it_has(tmp_path):
    np.savez(tmp_path / "a.npz", vertices=POINTS)
    with pytest.raises(CloudError, match="vertices"):
        read_cloud(tmp_path / "a.npz")


BAD = {
    "pickle": (
        "a.npy",
        b"\x93NUMPY\x01\x00" + b"\x46\x00{'descr': '|O', 'fortran_order': False, "
        b"'shape': (3,), }" + b" " * 12 + b"\n",
        "plain NumPy",
    ),
    "truncated npy": ("a.npy", b"\x93NUMPY\x01\x00", "truncated"),
    "truncated npz": ("a.npz", b"PK\x03\x04 nothing more", "truncated"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_is_refused_with_its_name_and_the_reason(tmp_path, case):
    check_refused(tmp_path, *BAD[case])
