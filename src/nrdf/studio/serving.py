"""The studio's server: on this computer, for its own pages, and without a way to the outside."""

from __future__ import annotations

import contextlib
import io
import re
import socket
from functools import partial
from unittest.mock import patch

import viser
import websockets.asyncio.server

from nrdf.errors import OutputError

LOOPBACK = ("127.0.0.1", "localhost", "::1")
_OWN_PAGES = re.compile(r"http://(127\.0\.0\.1|localhost|\[::1\])(:\d+)?")


def open_server(host: str, port: int) -> viser.ViserServer:
    """A viser server with nothing on it; on the next free port where `port` is taken.

    On loopback, only pages of loopback may connect: a page of the internet that is open in the
    same browser may not. Raises OutputError for a port or host that cannot be listened on.
    """
    if not 1 <= port <= 65535:
        raise OutputError(f"--port {port}: must be from 1 to 65535")
    _check(host)
    # viser hands no such limit on to websockets, and prints a banner of its own.
    origins = [_OWN_PAGES, None] if host in LOOPBACK else None
    serve = partial(websockets.asyncio.server.serve, origins=origins)
    with (
        patch.object(websockets.asyncio.server, "serve", serve),
        contextlib.redirect_stdout(io.StringIO()),
    ):
        server = viser.ViserServer(host, port, label="nrdf studio", verbose=False)
    # Every page could ask for a public address that leads here.
    server.request_share_url = lambda verbose=True: None  # type: ignore[method-assign]
    return server


def _check(host: str) -> None:
    """Raise OutputError unless there is an address `host` of this computer."""
    try:
        family = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)[0][0]
        with socket.socket(family, socket.SOCK_STREAM) as tried:
            tried.bind((host, 0))
    except OSError as error:
        raise OutputError(
            f"--host {host}: cannot be listened on ({error.strerror or error}); give an address of "
            "this computer, such as 127.0.0.1"
        ) from None
