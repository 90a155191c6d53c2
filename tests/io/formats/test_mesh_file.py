"""Meshes from files: what cannot be read is named with the reason."""

from __future__ import annotations

import pytest

from nrdf.errors import DataError
from nrdf.io.formats.mesh_file import load_mesh


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.ply", b"ply\nnothing", "unreadable"),
        ("a.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n", "unreadable"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no faces|unreadable"),
        ("a.stl", b"solid x\nendsolid x\n", "no faces|unreadable"),
        ("a.obj", b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "NaN|no surface"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 7\n", "unreadable|damaged"),
    ],
)
def test_a_bad_mesh_file_is_named_with_the_reason(tmp_path, name, content, message):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(DataError, match=message):
        load_mesh(tmp_path / name)


def test_a_missing_mesh_file_is_an_error(tmp_path):
    with pytest.raises(DataError, match=r"nothing\.stl"):
        load_mesh(tmp_path / "nothing.stl")
