"""What is no file, where knowledge and jobs name one: refused at once, never waited for."""

from __future__ import annotations

import json
import os

import pytest

from builders.fuzzing import message_of
from builders.solids import box
from nrdf.io.cloud import PointCloud, write_cloud
from nrdf.process.bound_knowledge import checksum, read_bound_knowledge
from nrdf.toolpath.file import read_toolpaths

SAND = {"kind": "sand", "stepover_mm": 15, "tool": {"radius_mm": 25}, "feed_mm_s": 100}


def bound_knowledge(folder, reference="ref.ply", region="region.ply"):
    points, normals = box((0.5, 0.9, 0.6), 1500)
    for name, chosen in (("ref.ply", slice(None)), ("region.ply", normals[:, 1] > 0.5)):
        write_cloud(folder / name, PointCloud(points[chosen], normals[chosen], "m"))
    regions = [{"name": "top", "file": region, "processes": [SAND]}]
    content = {"category": "chair", "reference": {"cloud": reference}, "regions": regions}
    (folder / "k.json").write_text(json.dumps(content))
    return read_bound_knowledge(folder / "k.json")


def test_knowledge_of_files_is_read(tmp_path):
    assert set(bound_knowledge(tmp_path).regions) == {"top"}


@pytest.mark.parametrize(("kind", "word"), [("pipe", "pipe"), ("folder", "fold"), ("none", "odd")])
@pytest.mark.parametrize("place", ["reference", "region", "region array", "knowledge", "job"])
def test_is_refused_at_once(tmp_path, kind, word, place):
    odd = tmp_path / ("odd.npz" if place == "region array" else "odd.ply")
    if kind == "pipe":
        os.mkfifo(odd)
    elif kind == "folder":
        odd.mkdir()
    call = {
        "reference": lambda: bound_knowledge(tmp_path, reference=odd.name),
        "region": lambda: bound_knowledge(tmp_path, region=odd.name),
        "region array": lambda: bound_knowledge(tmp_path, region=odd.name),
        "knowledge": lambda: read_bound_knowledge(odd),
        "job": lambda: read_toolpaths(odd),
    }[place]
    message = message_of(call)
    assert "odd" in message and word in message


def test_a_checksum_is_of_regular_files(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    assert "pipe" in message_of(lambda: checksum(tmp_path / "pipe"))
    assert "folder" in message_of(lambda: checksum(tmp_path))
