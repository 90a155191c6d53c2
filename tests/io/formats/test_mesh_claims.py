"""Mesh files that claim more than they hold."""

from __future__ import annotations

import pytest
import trimesh

from nrdf.errors import CloudError
from nrdf.io.cloud import read_cloud


def test_a_mesh_ply_with_a_wrong_face_count_is_refused(tmp_path):
    trimesh.creation.box().export(tmp_path / "a.ply")
    content = (tmp_path / "a.ply").read_bytes()
    (tmp_path / "a.ply").write_bytes(content.replace(b"element face 12", b"element face 12000000"))
    with pytest.raises(CloudError, match="truncated"):
        read_cloud(tmp_path / "a.ply")
