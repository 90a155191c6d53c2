"""Files that were sent: each is read, in its turn, and what it is goes to who asked for it."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from builders.studio_page import small_box
from nrdf.errors import CloudError
from nrdf.io.cloud import write_cloud


def test_files_are_read_one_after_another_and_none_replaces_another(page, tmp_path):
    from nrdf.studio.file_reading import read_object

    write_cloud(tmp_path / "box.ply", small_box())
    sent = SimpleNamespace(name="box.ply", content=(tmp_path / "box.ply").read_bytes())
    got, studio = [], page.studio
    for _ in range(3):
        read_object(studio, sent, "chair", None, lambda cloud: got.append(len(cloud)))
    assert studio.worker.wait(60)
    assert got == [len(small_box())] * 3


def test_what_is_no_object_is_refused_before_it_is_read(page):
    from nrdf.studio.file_reading import read_scan

    with pytest.raises(CloudError, match=r"notes\.doc is no point cloud or mesh"):
        read_scan(page.studio, SimpleNamespace(name="notes.doc", content=b""), None, print)
