"""`nrdf serve`: a real server, asked by the client of the examples."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
import urllib.request

import pytest

from builders.cells import cell_of
from nrdf import cli
from nrdf.bundled import KNOWLEDGE
from nrdf.cell.file import new_cell, write_cell

pytest.importorskip("fastapi")


@pytest.fixture
def place(tmp_path):
    write_cell(tmp_path / "cell.yaml", new_cell([KNOWLEDGE], "test", ["json"], tmp_path))
    (tmp_path / "bad.ply").write_text("no cloud")
    return tmp_path


def test_what_cannot_serve_is_said_at_once(place, capsys):
    cell = str(place / "cell.yaml")
    (place / "token").write_text("short")
    assert cli.run(["serve", cell, "--token-file", str(place / "token")]) == 2
    assert cli.run(["serve", cell, "--root", str(place / "none")]) == 2
    write_cell(place / "empty.yaml", cell_of())
    assert cli.run(["serve", str(place / "empty.yaml")]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "16 characters or more" in said and "is no folder" in said
    assert "names no knowledge file" in said


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_a_server_answers_the_clients_of_the_examples(place):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = str(free.getsockname()[1])
    code = "import sys; from nrdf import cli; sys.exit(cli.run(sys.argv[1:]))"
    words = ["serve", place / "cell.yaml", "--out", place / "out", "--port", port]
    server = subprocess.Popen([sys.executable, "-c", code, *map(str, words)])
    try:
        url, end = f"http://127.0.0.1:{port}", time.monotonic() + 120
        while time.monotonic() < end:
            try:
                with urllib.request.urlopen(f"{url}/healthz", timeout=5) as answer:
                    assert json.load(answer)["status"] == "ok"
                    break
            except OSError:
                time.sleep(0.2)
        client = os.path.join(os.path.dirname(__file__), "../../examples/line_client.py")
        done = subprocess.run(
            [sys.executable, client, url, str(place / "bad.ply")], capture_output=True, text=True,
            timeout=120,
        )  # fmt: skip
        assert done.returncode == 1 and "refused: " in done.stdout, done.stderr
    finally:
        server.terminate()
        assert server.wait(timeout=30) in (0, -15)
    assert (place / "out" / "index.html").is_file()
