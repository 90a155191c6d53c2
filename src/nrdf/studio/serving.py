"""The studio's server: on this computer, for its own pages, and without a way to the outside."""

from __future__ import annotations

import contextlib
import io
import socket
from collections.abc import Callable, Iterable
from http import HTTPStatus
from typing import Any
from unittest.mock import patch

import viser
import websockets.asyncio.server
from viser._messages import (
    FileTransferPart,
    FileTransferStartUpload,
    GetRenderResponseMessage,
    ViewerCameraMessage,
)
from viser.infra import ClientId, Message
from websockets.asyncio.server import Request, Response, ServerConnection

from nrdf.errors import OutputError
from nrdf.serve.hosts import allowed_hosts, is_own_page, serves
from nrdf.studio.model.uploads import LARGEST_UPLOAD, shown_name, too_large
from nrdf.studio.page_requests import PageRequests

_WRONG_HOST = "the studio answers to the address that it has printed; --allow-host adds a name\n"
_WRONG_ORIGIN = "the studio answers to its own pages alone\n"
_OF_LOOKING = (ViewerCameraMessage, GetRenderResponseMessage)
_CLOSED = {
    "Content-Security-Policy": "frame-ancestors 'none'",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Resource-Policy": "same-origin",
}
"""So that no other page shows this one within itself, and takes clicks for it."""


class StudioServer(viser.ViserServer):
    """page: what the page asks for beside viser's own. may_change: whether a browser, by its id, is
    listened to; of others only the camera is."""

    page: PageRequests
    may_change: Callable[[int], bool]


def open_server(host: str, port: int, more_hosts: Iterable[str] = ()) -> StudioServer:
    """A viser server with nothing on it; on the next free port where `port` is taken.

    Only its own pages may connect, by loopback's names, `host` and `more_hosts`: neither a page of
    another site that is open in the same browser, nor one whose name was made to lead here, gets
    anything. Uploads that are too large are refused before memory is taken. Raises OutputError for
    a port or host that cannot be listened on.
    """
    if not 1 <= port <= 65535:
        raise OutputError(f"--port {port}: must be from 1 to 65535")
    _check(host)
    # viser hands no such limit on to websockets, and prints a banner of its own.
    serve, page = websockets.asyncio.server.serve, PageRequests()
    own = _serve_own(serve, allowed_hosts(host, more_hosts), page)
    with (
        patch.object(websockets.asyncio.server, "serve", own),
        contextlib.redirect_stdout(io.StringIO()),
    ):
        server = StudioServer(host, port, label="nrdf studio", verbose=False)
    server.page, server.may_change = page, lambda _: True
    _hold_back(server)
    # Every page could ask for a public address that leads here.
    server.request_share_url = lambda verbose=True: None  # type: ignore[method-assign]
    _limit_uploads(server)
    return server


def _serve_own(
    serve: Callable[..., Any], allowed: frozenset[str], page: PageRequests
) -> Callable[..., Any]:
    """websockets' `serve` for these names of this machine, and for its own pages alone."""

    def serve_own(*args: Any, process_request: Any = None, **options: Any) -> Any:
        def answer(connection: ServerConnection, request: Request) -> Response | None:
            hosts = request.headers.get_all("Host")
            if not serves(allowed, hosts):
                return connection.respond(HTTPStatus.FORBIDDEN, _WRONG_HOST)
            if not all(is_own_page(o, hosts[0]) for o in request.headers.get_all("Origin")):
                return connection.respond(HTTPStatus.FORBIDDEN, _WRONG_ORIGIN)
            found: Response | None = page.respond(request)
            if found is None and process_request:
                found = process_request(connection, request)
            if found is not None:
                found.headers.update(_CLOSED)
            return found

        return serve(*args, process_request=answer, **options)

    return serve_own


def _hold_back(server: StudioServer) -> None:
    """Let browsers that only look on do nothing: neither inputs, nor clicks, drags and files."""
    inner = server._websock_server
    handle = inner._handle_incoming_message

    async def hold_back(client_id: ClientId, message: Message) -> None:
        if isinstance(message, _OF_LOOKING) or server.may_change(client_id):
            await handle(client_id, message)

    inner._handle_incoming_message = hold_back  # type: ignore[method-assign]


def _limit_uploads(server: viser.ViserServer) -> None:
    """Let uploads on their way hold no more than `LARGEST_UPLOAD` in all; viser takes any."""
    gui = server.gui
    inner = gui._websock_interface
    begin, go_on = gui._handle_file_transfer_start, gui._handle_file_transfer_part
    underway = gui._current_file_upload_states

    def limited_start(client_id: ClientId, message: FileTransferStartUpload) -> None:
        others = sum(state["total_bytes"] for state in list(underway.values()))
        parts_fit = 0 <= message.part_count <= message.size_bytes
        if message.size_bytes + others <= LARGEST_UPLOAD and parts_fit:
            begin(client_id, message)
        elif client_id in server.get_clients():
            server.get_clients()[client_id].add_notification(
                "Too large", too_large(shown_name(message.filename), message.size_bytes),
                color="red", auto_close_seconds=15,
            )  # fmt: skip

    def limited_part(client_id: ClientId, message: FileTransferPart) -> None:
        state = underway.get(message.transfer_uuid)
        if state is None:
            return
        if state["transferred_bytes"] + len(message.content) > state["total_bytes"]:
            underway.pop(message.transfer_uuid, None)  # more than it has announced
        else:
            go_on(client_id, message)

    inner.unregister_handler(FileTransferStartUpload, begin)  # type: ignore[arg-type]
    inner.register_handler(FileTransferStartUpload, limited_start)
    inner.unregister_handler(FileTransferPart, go_on)  # type: ignore[arg-type]
    inner.register_handler(FileTransferPart, limited_part)


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
