"""PCD files: colours, intensity, the sensor, gaps and compression."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from builders.cloud_files import COLOURS, POINTS, ROWS, check_refused
from nrdf.errors import CloudError
from nrdf.io.cloud import read_cloud
from nrdf.io.formats.pcd import decompress_lzf


def pcd(data: bytes, kind: str, viewpoint: str = "", height: int = 1, count: int = 4) -> bytes:
    place = f"VIEWPOINT {viewpoint}\n" if viewpoint else ""
    size = f"WIDTH {count // height}\nHEIGHT {height}\n{place}POINTS {count}\n"
    return (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb intensity\nSIZE 4 4 4 4 4\nTYPE F F F U F\n"
        f"COUNT 1 1 1 1 1\n{size}DATA {kind}\n"
    ).encode() + data


ASCII = "".join(f"{r['x']} {r['y']} {r['z']} {r['rgb']} {r['i']}\n" for r in ROWS).encode()


def literal_lzf(raw: bytes) -> bytes:
    pieces = (raw[i : i + 32] for i in range(0, len(raw), 32))
    return b"".join(bytes([len(piece) - 1]) + piece for piece in pieces)


def compressed() -> bytes:
    raw = b"".join(np.ascontiguousarray(ROWS[name]).tobytes() for name in ROWS.dtype.names)
    packed = literal_lzf(raw)
    return struct.pack("<II", len(packed), len(raw)) + packed


@pytest.mark.parametrize(
    ("kind", "data"),
    [("ascii", ASCII), ("binary", ROWS.tobytes()), ("binary_compressed", compressed())],
)
def test_pcd_gives_colours_intensity_and_the_sensor(tmp_path, kind, data):
    (tmp_path / "a.pcd").write_bytes(pcd(data, kind, "1 2 3 1 0 0 0"))
    cloud = read_cloud(tmp_path / "a.pcd")
    np.testing.assert_allclose(cloud.points, POINTS, rtol=1e-6)
    np.testing.assert_array_equal(cloud.colours, COLOURS)
    np.testing.assert_array_equal(cloud.intensity, ROWS["i"])
    np.testing.assert_array_equal(cloud.sensors, [[1, 2, 3]])


def test_a_viewpoint_at_the_origin_counts_in_grids_only(tmp_path):
    for height, known in ((1, False), (2, True)):
        (tmp_path / "a.pcd").write_bytes(pcd(ASCII, "ascii", "0 0 0 1 0 0 0", height))
        assert (read_cloud(tmp_path / "a.pcd").sensors is not None) == known


def test_pixels_that_measured_nothing_are_dropped_from_pcd(tmp_path, caplog):
    rows = ROWS.copy()
    rows["x"][1:] = np.nan
    (tmp_path / "a.pcd").write_bytes(pcd(rows.tobytes(), "binary"))
    with caplog.at_level("INFO"):
        cloud = read_cloud(tmp_path / "a.pcd")
    assert len(cloud) == len(cloud.colours) == len(cloud.intensity) == 1
    assert "dropped 3 points" in caplog.text
    rows["x"] = np.nan
    (tmp_path / "a.pcd").write_bytes(pcd(rows.tobytes(), "binary"))
    with pytest.raises(CloudError, match="none of its 4 points was measured"):
        read_cloud(tmp_path / "a.pcd")


def test_lzf_repeats_what_came_before_even_into_itself():
    # "abc" as it is, then 9 bytes from 3 back, then 20 from 1 back (a long length).
    packed = bytes([2]) + b"abc" + bytes([(7 << 5), 0, 2]) + bytes([7 << 5, 11, 0])
    assert decompress_lzf(packed, 32) == b"abc" * 4 + b"c" * 20
    for wrong, size, message in (
        (packed, 31, "give 32 of 31"),
        (packed[:-1], 32, "truncated within"),
        (bytes([1 << 5, 5]), 3, "what was not there"),
        (bytes([31]) + b"short", 32, "give 5 of 32"),
    ):
        with pytest.raises(ValueError, match=message):
            decompress_lzf(wrong, size)


BAD = {
    "compressed pcd": (
        "a.pcd",
        b"VERSION 7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 1\nDATA binary_compressed\n",
        "nothing follows",
    ),
    "pcd of a new kind": (
        "a.pcd",
        b"VERSION 7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 1\nDATA zipped\n",
        "known: ascii, binary, binary_compressed",
    ),
    "truncated pcd": (
        "a.pcd",
        b"VERSION 7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 2\nDATA binary\n123456789012",
        "1 of 2",
    ),
    "pcd without x": (
        "a.pcd",
        b"VERSION 7\nFIELDS y z\nSIZE 4 4\nTYPE F F\nPOINTS 1\nDATA ascii\n1 2\n",
        "x, y and z",
    ),
    "pcd without data": ("a.pcd", b"VERSION 7\nFIELDS x y z\n", "DATA"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_is_refused_with_its_name_and_the_reason(tmp_path, case):
    check_refused(tmp_path, *BAD[case])
