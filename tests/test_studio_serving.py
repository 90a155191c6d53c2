"""`nrdf studio` and its server: who may connect, where it listens, what it says."""

from __future__ import annotations

import pytest

pytest.importorskip("viser", reason="pip install 'nrdf[studio]'")

import viser
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from nrdf import cli
from nrdf.errors import OutputError
from nrdf.studio.serving import open_server


@pytest.fixture
def server():
    made = open_server("127.0.0.1", 8470)
    yield made
    made.stop()


def test_pages_of_elsewhere_may_not_connect(server):
    address = f"ws://127.0.0.1:{server.get_port()}"
    version = f"viser-v{viser.__version__}"
    with connect(address, origin="http://localhost:8470", subprotocols=[version]) as own:
        assert own.recv(timeout=10)
    for origin in ("http://evil.example", "http://127.0.0.1.evil.example", "null"):
        with pytest.raises(InvalidStatus, match="403"):
            connect(address, origin=origin, subprotocols=[version])


def test_nothing_leads_to_the_outside(server):
    assert server.request_share_url() is None


def test_a_port_that_is_taken_gives_the_next(server):
    other = open_server("127.0.0.1", server.get_port())
    assert other.get_port() != server.get_port()
    other.stop()


def test_what_cannot_be_listened_on_is_said():
    with pytest.raises(OutputError, match="--port 0: must be from 1 to 65535"):
        open_server("127.0.0.1", 0)
    with pytest.raises(OutputError, match=r"--host 192\.0\.2\.1: cannot be listened on"):
        open_server("192.0.2.1", 8470)


def run(monkeypatch, *words):
    """The verb, with Ctrl-C at once."""

    def interrupt(self):
        raise KeyboardInterrupt

    monkeypatch.setattr(viser.ViserServer, "sleep_forever", interrupt)
    return cli.run(["studio", "--no-browser", "--port", "8471", *words])


def test_the_verb_prints_its_address_and_ends_with_130(tmp_path, monkeypatch, capsys):
    assert run(monkeypatch, "--session", str(tmp_path / "s")) == 130
    said = capsys.readouterr()
    assert "http://127.0.0.1:8471" in said.out and "no password" not in said.err
    assert (tmp_path / "s" / "clouds").is_dir()


def test_bound_elsewhere_it_warns(tmp_path, monkeypatch, capsys):
    assert run(monkeypatch, "--host", "0.0.0.0", "--session", str(tmp_path / "s")) == 130
    assert "there is no password" in " ".join(capsys.readouterr().err.split())


def test_a_browser_is_opened_unless_told_otherwise(tmp_path, monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    run(monkeypatch, "--session", str(tmp_path / "s"))
    assert opened == []
    monkeypatch.setattr(viser.ViserServer, "sleep_forever", lambda self: None)
    cli.run(["studio", "--port", "8472", "--session", str(tmp_path / "s")])
    assert opened == ["http://127.0.0.1:8472"]


def test_a_session_that_cannot_be_kept_is_refused(tmp_path, monkeypatch, capsys):
    (tmp_path / "file").write_text("")
    assert run(monkeypatch, "--session", str(tmp_path / "file" / "s")) == 2
    assert "give another one with --session" in " ".join(capsys.readouterr().err.split())
