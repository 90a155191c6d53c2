"""PLY files: headers, rows and what cannot be read."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from builders.cloud_files import NORMALS, POINTS, TEXT, check_refused, ply_header
from nrdf.io.cloud import PointCloud, write_cloud
from nrdf.io.ply import read_header, read_scalars


def test_further_properties_are_written(tmp_path):
    confidence = np.array([0.0, 0.5, 1.0, 0.25])
    colours = np.arange(12, dtype=np.uint8).reshape(4, 3)
    path = tmp_path / "a.ply"
    write_cloud(path, PointCloud(POINTS, NORMALS), colours,
                {"confidence": confidence, "chosen": confidence > 0.3})  # fmt: skip
    columns = read_scalars(path, read_header(path))
    np.testing.assert_array_equal(columns["confidence"], confidence)
    np.testing.assert_array_equal(columns["chosen"], [0, 1, 1, 0])
    np.testing.assert_array_equal(columns["green"], colours[:, 1])
    assert [p.name for p in tmp_path.iterdir()] == ["a.ply"]


BAD = {
    "no vertices": ("a.ply", ply_header(count=0), "no points"),
    "no header end": ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 3\n", "end_header"),
    "no format": ("a.ply", b"ply\nelement vertex 0\nproperty float x\nend_header\n", "format"),
    "odd format": ("a.ply", ply_header("middle_endian"), "middle_endian"),
    "odd type": ("a.ply", ply_header(properties=["quad x"]), "quad x"),
    "no properties": ("a.ply", ply_header(properties=[]), "no property"),
    "twice": ("a.ply", ply_header(properties=["float x", "float x"]), "twice"),
    "no z": ("a.ply", ply_header(count=1, properties=["float x", "float y"]) + b"1 2\n", "z are"),
    "no vertex": ("a.ply", b"ply\nformat ascii 1.0\nend_header\n", "no element 'vertex'"),
    "negative count": ("a.ply", ply_header(count=-5) + TEXT.encode(), "cannot understand"),
    "truncated ascii": ("a.ply", ply_header() + TEXT[:20].encode(), "truncated"),
    "truncated binary": (
        "a.ply",
        ply_header("binary_little_endian") + POINTS.tobytes()[:-1],
        "truncated",
    ),
    "huge ascii": ("a.ply", ply_header(count=10**8) + TEXT.encode(), "truncated"),
    "huge binary": (
        "a.ply",
        ply_header("binary_little_endian", count=10**8) + POINTS.tobytes(),
        "truncated",
    ),
    "beyond all": ("a.ply", ply_header(count=10**18) + TEXT.encode(), "at most"),
    "endless list": (
        "a.ply",
        ply_header("binary_little_endian", 1, ["list uint double l", "double x"])
        + struct.pack("<Id", 2**31, 1.0),
        "truncated",
    ),
    "negative list": (
        "a.ply",
        ply_header("binary_little_endian", 1, ["list int double l", "uchar x"])
        + struct.pack("<iB", -8, 1),
        "length -8",
    ),
    "float list": ("a.ply", ply_header(properties=["list float int l"]), "integer"),
    "long ascii row": ("a.ply", ply_header(count=1) + b"1 2 3 4\n", "damaged"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_is_refused_with_its_name_and_the_reason(tmp_path, case):
    check_refused(tmp_path, *BAD[case])
