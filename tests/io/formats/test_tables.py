"""Clouds as text in columns, named or not."""

from __future__ import annotations

import numpy as np
import pytest

from builders.cloud_files import COLOURS, POINTS, ROWS, check_refused
from nrdf.io.cloud import read_cloud


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.csv", "x,y,z,red,green,blue,intensity\n"),
        ("a.txt", "# X Y Z R G B Intensity\n"),
        ("a.xyz", "//x y z intensity r g b\n"),
    ],
)
def test_named_columns_of_text_are_followed(tmp_path, name, content):
    middle = [COLOURS, ROWS["i"][:, None]]
    table = np.hstack([POINTS, *(middle if name != "a.xyz" else middle[::-1])])
    delimiter = "," if name == "a.csv" else " "
    rows = "\n".join(delimiter.join(f"{v:.9g}" for v in row) for row in table)
    (tmp_path / name).write_text(content + rows)
    cloud = read_cloud(tmp_path / name)
    np.testing.assert_allclose(cloud.points, POINTS)
    np.testing.assert_array_equal(cloud.colours, COLOURS)
    np.testing.assert_array_equal(cloud.intensity, ROWS["i"])


def test_unnamed_columns_are_told_by_their_values(tmp_path):
    np.savetxt(tmp_path / "a.xyz", np.hstack([POINTS, COLOURS]))
    np.testing.assert_array_equal(read_cloud(tmp_path / "a.xyz").colours, COLOURS)
    np.savetxt(tmp_path / "b.xyz", np.hstack([POINTS, ROWS["i"][:, None]]))
    np.testing.assert_array_equal(read_cloud(tmp_path / "b.xyz").intensity, ROWS["i"])


BAD = {
    "prose": ("a.txt", b"Dear reader,\nno points here.\n", "not a point cloud"),
    "two columns": ("a.xyz", b"1 2\n3 4\n", "three or more"),
    "ragged": ("a.xyz", b"1 2 3\n4 5\n6 7 8\n", "table of numbers"),
    "word": ("a.csv", b"1,2,3\n4,x,6\n", "table of numbers"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_is_refused_with_its_name_and_the_reason(tmp_path, case):
    check_refused(tmp_path, *BAD[case])
