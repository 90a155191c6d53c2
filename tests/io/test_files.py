"""Only regular files are opened, and nothing waits for a pipe."""

from __future__ import annotations

import os
import socket

import pytest

from nrdf.errors import CloudError, ModelError
from nrdf.io.files import open_file, read_file, require_file

POSIX = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no named pipes")


def test_a_file_is_opened_with_its_size(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(b"12345")
    (tmp_path / "link").symlink_to(path)
    for name in (path, str(path), tmp_path / "link"):
        assert require_file(name, CloudError) == 5
        assert read_file(name, CloudError, 5) == b"12345"
        with open_file(name, CloudError) as file:
            assert file.read() == b"12345"


@pytest.mark.parametrize("call", [require_file, open_file, lambda p, e: read_file(p, e, 10)])
class TestWhatIsNoFile:
    @POSIX
    def test_a_pipe(self, tmp_path, call):
        os.mkfifo(tmp_path / "pipe.ply")
        with pytest.raises(CloudError, match=r"pipe\.ply: it is a pipe \(FIFO\); a file is needed"):
            call(tmp_path / "pipe.ply", CloudError)

    @POSIX
    def test_a_device(self, call):
        with pytest.raises(ModelError, match="it is a device"):
            call(os.devnull, ModelError)

    @POSIX
    def test_a_socket(self, tmp_path, call, monkeypatch):
        monkeypatch.chdir(tmp_path)  # a socket's name must be short
        with socket.socket(socket.AF_UNIX) as server:
            server.bind("s")
            with pytest.raises(CloudError, match="it is a socket"):
                call("s", CloudError)

    def test_a_folder(self, tmp_path, call):
        with pytest.raises(CloudError, match="it is a folder"):
            call(tmp_path, CloudError)

    @pytest.mark.parametrize("name", ["nothing", "a\0b", "x" * 5000])
    def test_nothing(self, tmp_path, call, name):
        with pytest.raises(CloudError, match="cannot read") as caught:
            call(f"{tmp_path}/{name}", CloudError)
        assert "\0" not in str(caught.value)


@POSIX
def test_a_pipe_that_takes_the_files_place_is_refused(tmp_path, monkeypatch):
    os.mkfifo(tmp_path / "pipe")
    monkeypatch.setattr("nrdf.io.files.require_file", lambda *_: 0)
    with pytest.raises(CloudError, match="it is a pipe"):
        open_file(tmp_path / "pipe", CloudError)


def test_too_large_a_file_is_refused(tmp_path):
    (tmp_path / "a").write_bytes(b"12345")
    with pytest.raises(CloudError, match="has more than 4e-06 MB"):
        read_file(tmp_path / "a", CloudError, 4)
