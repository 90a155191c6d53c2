"""`nrdf studio` and its server: who may connect, where it listens, what it says."""

from __future__ import annotations

import asyncio
import socket

import pytest

pytest.importorskip("viser", reason="pip install 'nrdf[studio]'")

import viser
from viser._messages import FileTransferPart, FileTransferStartUpload, GuiUpdateMessage
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from nrdf import cli
from nrdf.errors import OutputError
from nrdf.studio.model.uploads import LARGEST_UPLOAD
from nrdf.studio.serving import open_server


@pytest.fixture
def server():
    made = open_server("127.0.0.1", 8470)
    yield made
    made.stop()


def test_pages_of_elsewhere_may_not_connect(server):
    port = server.get_port()
    version = f"viser-v{viser.__version__}"
    for name in ("127.0.0.1", "localhost"):
        address = f"{name}:{port}"
        with connect(f"ws://{address}", origin=f"http://{address}", subprotocols=[version]) as own:
            assert own.recv(timeout=10)
    foreign = (
        "http://evil.example", "http://127.0.0.1.evil.example", f"http://localhost:{port}",
        "http://127.0.0.1:3000", "null",
    )  # fmt: skip
    for origin in foreign:
        with pytest.raises(InvalidStatus, match="403"):
            connect(f"ws://127.0.0.1:{port}", origin=origin, subprotocols=[version])
        assert get(port, f"127.0.0.1:{port}", f"Origin: {origin}").startswith("HTTP/1.1 403 ")


def test_of_a_page_that_looks_on_nothing_is_taken(server):
    field = server.gui.add_number("Feed", 5.0)
    sent = GuiUpdateMessage(field._impl.uuid, {"value": 7.0})
    server.may_change = lambda page: page == 1
    take = server._websock_server._handle_incoming_message
    asyncio.run(take(2, sent))
    assert field.value == 5.0
    asyncio.run(take(1, sent))
    assert field.value == 7.0


def test_no_other_page_shows_it_within_itself(server):
    page = get(server.get_port(), "localhost")
    assert page.startswith("HTTP/1.1 200 ")
    assert "frame-ancestors 'none'" in page and "X-Frame-Options: DENY" in page


def test_where_others_can_ask_the_same_holds():
    made = open_server("0.0.0.0", 8475, ["studio.local"])
    try:
        port = made.get_port()
        for host in ("192.0.2.7:8475", "studio.local"):
            assert get(port, host).startswith("HTTP/1.1 200 ")
        assert get(port, "evil.example").startswith("HTTP/1.1 403 ")
        with pytest.raises(InvalidStatus, match="403"):
            connect(f"ws://127.0.0.1:{port}", origin="http://evil.example")
    finally:
        made.stop()


def get(port, host, *lines):
    """What is answered to a GET at that host, its beginning."""
    with socket.create_connection(("127.0.0.1", port), timeout=10) as asked:
        asked.sendall("\r\n".join(["GET / HTTP/1.1", f"Host: {host}", *lines, "", ""]).encode())
        return asked.recv(4096).decode("latin-1")


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


def test_a_damaged_session_is_said_and_the_studio_runs(tmp_path, monkeypatch, capsys):
    (tmp_path / "s").mkdir()
    (tmp_path / "s" / "session.json").write_text('{"version": 1, "category": 3}')
    assert run(monkeypatch, "--session", str(tmp_path / "s")) == 130
    assert "It is kept as it was in" in " ".join(capsys.readouterr().err.split())


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
    said = " ".join(capsys.readouterr().err.split())
    assert "cannot write" in said and "choose another place" in said


@pytest.mark.parametrize(
    ("host", "status"),
    [
        ("127.0.0.1:8470", 200),
        ("localhost", 200),
        ("[::1]:8470", 200),
        ("evil.example:8470", 403),
        ("127.0.0.1.evil.example", 403),
        ("", 403),
    ],
)
def test_a_name_that_was_made_to_lead_here_gets_nothing(server, host, status):
    port = server.get_port()
    assert get(port, host).startswith(f"HTTP/1.1 {status} ")
    if host:
        version = f"viser-v{viser.__version__}"
        header = {"subprotocols": [version], "host": host}
        assert handshake(port, **header) == (101 if status == 200 else 403)


def handshake(port, subprotocols, host):
    """The status of a WebSocket that is asked for at that host, without an origin."""
    with socket.create_connection(("127.0.0.1", port), timeout=10) as asked:
        lines = [
            "GET / HTTP/1.1", f"Host: {host}", "Upgrade: websocket", "Connection: Upgrade",
            "Sec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==", "Sec-WebSocket-Version: 13",
            f"Sec-WebSocket-Protocol: {subprotocols[0]}", "", "",
        ]  # fmt: skip
        asked.sendall("\r\n".join(lines).encode())
        return int(asked.recv(4096).split()[1])


def test_two_hosts_are_refused(server):
    with socket.create_connection(("127.0.0.1", server.get_port()), timeout=10) as asked:
        asked.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\n\r\n")
        assert asked.recv(4096).startswith(b"HTTP/1.1 403 ")


def test_uploads_hold_no_more_than_their_limit(server):
    button = server.gui.add_upload_button("file")
    states = server.gui._current_file_upload_states

    def send(message):
        for handler in server.gui._websock_interface._incoming_handlers[type(message)]:
            handler(0, message)

    def start(name, size, parts=1):
        uuid = button._impl.uuid
        send(FileTransferStartUpload(uuid, name, f"{name}.ply", "", parts, size))

    start("huge", LARGEST_UPLOAD + 1)
    start("no bytes in many parts", 10, 10**9)
    start("negative", -(10**12))
    assert not states
    start("one", LARGEST_UPLOAD - 100)
    start("another", 1000)
    assert list(states) == ["one"]
    start("small", 10, 2)
    for part in range(2):
        send(FileTransferPart(button._impl.uuid, "small", part, b"x" * 8))
    assert "small" not in states, "more than was announced"
