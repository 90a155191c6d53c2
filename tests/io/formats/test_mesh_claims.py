"""Mesh files that claim more than they hold."""

from __future__ import annotations

import json

import pytest
import trimesh

from nrdf.errors import CloudError
from nrdf.io.cloud import read_cloud
from nrdf.io.formats.mesh_claims import check_claimed_sizes, off_counts


def test_a_mesh_ply_with_a_wrong_face_count_is_refused(tmp_path):
    trimesh.creation.box().export(tmp_path / "a.ply")
    content = (tmp_path / "a.ply").read_bytes()
    (tmp_path / "a.ply").write_bytes(content.replace(b"element face 12", b"element face 12000000"))
    with pytest.raises(CloudError, match="truncated"):
        read_cloud(tmp_path / "a.ply")


def gltf(**more) -> dict:
    """A scene of one triangle, as its description has it."""
    return {
        "accessors": [{"count": 3, "componentType": 5126, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        **more,
    }


@pytest.mark.parametrize(
    ("scene", "message"),
    [
        (gltf(accessors=[{"count": 10**9, "componentType": 5126, "type": "VEC3"}]), "more than it"),
        (gltf(accessors=[{"count": 3, "componentType": 5126}]), "without count or type"),
        (gltf(nodes=[{"children": [0]}]), "in a circle"),
        (gltf(nodes=[{"children": [1, 1]}, {"mesh": 0}]), "stands at two places"),
        (gltf(nodes=[{"mesh": 7}]), "names number 7 of 1"),
        (gltf(nodes={}), "no list of objects"),
        (gltf(accessors=[{"count": 99, "componentType": 5121, "type": "SCALAR"}] * 2,
              nodes=[{"mesh": 0}] * 60_000), "faces; at most"),
    ],
)  # fmt: skip
def test_a_scene_that_claims_too_much_is_refused(tmp_path, scene, message):
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps(scene))
    with open(path, "rb") as file, pytest.raises(ValueError, match=message):
        check_claimed_sizes(path, file)


def test_claims_that_hold_pass(tmp_path):
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps(gltf()))
    with open(path, "rb") as file:
        check_claimed_sizes(path, file)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"OFF\n3 1 0\n0 0 0\n1 0 0\n", "truncated"),
        (b"OFF\n1 0 0\n0 0 0\n1 0 0\n", "more rows than it claims"),
        (b"OFF\n", "no counts"),
        (b"FOO\n1 0 0\n0 0 0\n", "begin with OFF"),
    ],
)
def test_counts_of_an_off_file_are_held_against_its_rows(tmp_path, content, message):
    with pytest.raises(ValueError, match=message):
        _off(tmp_path, content)


def _off(folder, content):
    (folder / "a.off").write_bytes(content)
    with open(folder / "a.off", "rb") as file:
        return off_counts(file)
