"""Files from a browser: size, type and name are not trusted; errors name the file as sent."""

from __future__ import annotations

import errno
from pathlib import Path

import numpy as np
import pytest

from builders.sent_files import archive
from builders.studio_page import small_box
from nrdf.errors import CloudError, OutputError, ProcessError
from nrdf.io.cloud import PointCloud, write_cloud
from nrdf.studio.model import uploads
from nrdf.studio.model.uploads import (
    LARGEST_UPLOAD,
    read_knowledge_zip,
    read_sent,
    read_upload,
    shown_name,
    thinned_reference,
)


@pytest.fixture
def content(tmp_path):
    box = small_box()
    write_cloud(tmp_path / "box.ply", PointCloud(1000 * box.points, box.normals, "mm"))
    return (tmp_path / "box.ply").read_bytes()


def test_a_cloud_comes_in_metres(content):
    read = read_upload("box.ply", content, "chair")
    np.testing.assert_allclose(read.points, small_box().points)
    assert read.unit == "m"


@pytest.mark.parametrize("name", ["box.exe", "box", "../../box.yaml", "box.ply.sh"])
def test_other_types_are_refused(name, content):
    with pytest.raises(CloudError, match=r"must end with one of \.ply"):
        read_upload(name, content, "chair")


def test_large_files_are_refused(content, monkeypatch):
    monkeypatch.setattr(uploads, "LARGEST_UPLOAD", 1000)
    with pytest.raises(CloudError, match=r"box\.ply has .* at most"):
        read_upload("box.ply", content, "chair")


def test_a_name_is_no_path(content, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    read_upload("../../../../etc/evil.ply", content, "chair")
    assert sorted(tmp_path.rglob("*")) == before


def test_the_readers_errors_name_the_file_as_it_was_sent(content):
    with pytest.raises(CloudError, match=r"^chair\.ply: ") as raised:
        read_upload("C:\\scans\\chair.ply", content[:-100], "chair")
    assert "upload" not in str(raised.value)
    with pytest.raises(CloudError, match=r"empty\.pcd"):
        read_upload("empty.pcd", b"", "chair")


def test_a_unit_that_nothing_tells_is_asked_for(tmp_path):
    write_cloud(tmp_path / "box.ply", PointCloud(7 * small_box().points))
    content = (tmp_path / "box.ply").read_bytes()
    with pytest.raises(ProcessError, match=r"box\.ply does not say its unit"):
        read_upload("box.ply", content, "chair")
    assert read_upload("box.ply", content, "chair", "in").unit == "m"


def test_names_are_short_and_printable():
    assert shown_name("a\nb\x00.ply") == "ab.ply" and shown_name("/") == "file"
    long = shown_name("x" * 300 + ".ply")
    assert len(long) <= 61 and long.endswith(".ply")


def test_a_dense_reference_is_thinned_as_the_model_does():
    dense = PointCloud(np.random.default_rng(0).normal(size=(20_000, 3)), unit="m")
    assert len(thinned_reference(dense)) == 16_384


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"PK no archive", "k.zip is no ZIP archive that can be read; give knowledge.zip"),
        (archive({"a/box.ply": "ply"}), "k.zip holds 0 knowledge files"),
        (archive({"a.yaml": "", "b/c.yml": ""}), "k.zip holds 2 knowledge files"),
        (archive({"a/x.yaml": "", "b/x.yaml": ""}), "x.yaml' is no name that is taken"),
        (archive({"con\n.yaml": ""}), "is no name that is taken"),
        (archive({"x.yaml": "category: 3"}), "^x.yaml"),
        (archive({str(i): "" for i in range(601)}), "holds 601 files; at most 600"),
        (archive({"x.yaml": bytes(LARGEST_UPLOAD + 1)}), "at most 600 of together 128 MiB"),
        (archive({"x.yaml": "a" * 5000})[:-2000], "no ZIP archive"),
    ],
)  # fmt: skip
def test_archives_that_hold_no_knowledge_are_refused(content, said):
    with pytest.raises(ProcessError, match=said):
        read_knowledge_zip("../k.zip", content)


def test_a_full_disk_is_said_to_be_one(monkeypatch):
    def full(self, content):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OutputError, match="No space left on device; free some space"):
        read_knowledge_zip("k.zip", archive({"a.yaml": "x"}))
    with pytest.raises(OutputError, match="No space left on device; free some space"):
        read_sent("a.ply", b"ply")
