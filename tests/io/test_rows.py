"""Rows of numbers, read some at a time."""

from __future__ import annotations

import io

import numpy as np
import pytest

from nrdf.io import rows
from nrdf.io.rows import binary_parts, count_rows, gather, text_parts, text_rows

TEXT = b"# a comment\n1 2\n\n3 4\n  # another\n5 6\n"
LAYOUT = np.dtype([("x", "<f4"), ("n", "<i2")])


def test_comments_and_blank_lines_are_no_rows():
    assert [row.split() for row in text_rows(io.BytesIO(TEXT))] == [
        [b"1", b"2"],
        [b"3", b"4"],
        [b"5", b"6"],
    ]
    assert count_rows(io.BytesIO(TEXT), 10) == 3
    assert count_rows(io.BytesIO(TEXT), 1) == 2  # one beyond is enough to know


@pytest.mark.parametrize("part", [1, 16, 1 << 20])
def test_text_comes_in_parts_of_any_size(monkeypatch, part):
    monkeypatch.setattr(rows, "_PART", part)
    parts = list(text_parts(io.BytesIO(TEXT), 3, 2))
    assert [start for start, _ in parts] == ([0] if part > 48 else [0, 1, 2])
    np.testing.assert_array_equal(np.concatenate([p for _, p in parts]), [[1, 2], [3, 4], [5, 6]])


@pytest.mark.parametrize(
    ("count", "width", "message"), [(4, 2, "ends before row 4"), (3, 3, "of 2 values")]
)
def test_text_of_another_shape_is_refused(count, width, message):
    with pytest.raises(ValueError, match=message):
        list(text_parts(io.BytesIO(TEXT), count, width))


@pytest.mark.parametrize("part", [1, 12, 1 << 20])
def test_binary_rows_are_gathered_by_name(monkeypatch, tmp_path, part):
    monkeypatch.setattr(rows, "_PART", part)
    table = np.array([(0.5, 1), (1.5, 2), (2.5, 3)], LAYOUT)
    (tmp_path / "a").write_bytes(table.tobytes())
    with open(tmp_path / "a", "rb") as file:
        columns = gather(binary_parts(file, LAYOUT, 3), 3, ["n"])
    assert list(columns) == ["n"]
    np.testing.assert_array_equal(columns["n"], [1, 2, 3])
    with (
        open(tmp_path / "a", "rb") as file,
        pytest.raises(EOFError, match="only 3 complete rows of 4"),
    ):
        gather(binary_parts(file, LAYOUT, 4), 4, ["n"])
