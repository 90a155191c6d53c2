"""What stands before the service: who may ask, and how much.

A browser on this machine can reach loopback too, so pages of other sites are told by their Origin,
and names that were rebound to this address by their Host.
"""

from __future__ import annotations

import asyncio
import hmac
import ipaddress
import json
from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit

from starlette.exceptions import HTTPException

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Message, Receive, Send], Awaitable[None]]

LOOPBACK = ("127.0.0.1", "localhost", "::1")
_OPEN = ("/healthz",)
"""Paths that need no token: what a load balancer asks."""


class _Refused(HTTPException):
    """A request that ends here; within the application it is answered as its own errors are."""


@dataclass(frozen=True)
class Guard:
    """Refuses requests before `app` sees them: 400 for a foreign Host, 403 for a foreign Origin,
    401 without the token, 413 for a body above `most_bytes`, 408 for one that does not come."""

    app: App
    hosts: frozenset[str]
    token: str | None
    most_bytes: int
    patience_s: float = 30.0

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            if scope["type"] == "lifespan":
                await self.app(scope, receive, send)
            return  # there are no web sockets here
        begun = False

        async def noting(message: Message) -> None:
            nonlocal begun
            begun = begun or message["type"] == "http.response.start"
            await send(message)

        try:
            self._check(scope)
            await self.app(scope, self._limited(receive), noting)
        except _Refused as refused:
            if not begun:
                await _answer(send, refused.status_code, refused.detail)

    def _check(self, scope: Message) -> None:
        headers: dict[str, list[str]] = {}
        for name, value in scope["headers"]:
            headers.setdefault(name.decode("latin-1").lower(), []).append(value.decode("latin-1"))
        hosts = headers.get("host", [])
        if len(hosts) != 1 or host_of(f"//{hosts[0]}") not in self.hosts:
            raise _Refused(400, "this Host is not served; --allow-host adds one")
        for origin in headers.get("origin", []):
            parts = urlsplit(origin)
            if parts.scheme not in ("http", "https") or parts.netloc.lower() != hosts[0].lower():
                raise _Refused(403, "requests from pages of another origin are not taken")
        if self.token is not None and scope["path"] not in _OPEN:
            given = headers.get("authorization", [""])[0].encode("latin-1", "replace")
            if not hmac.compare_digest(given, f"Bearer {self.token}".encode()):
                raise _Refused(401, "give the token: Authorization: Bearer TOKEN")
        for length in headers.get("content-length", []):
            if not length.isdigit() or int(length) > self.most_bytes:
                raise _Refused(413, f"a body has at most {self.most_bytes} bytes")

    def _limited(self, receive: Receive) -> Receive:
        """`receive`, which counts the body's bytes and waits only so long for more."""
        total, ended = 0, False

        async def limited() -> Message:
            nonlocal total, ended
            if ended:
                return await receive()  # a stream of events waits for its client to leave
            try:
                message = await asyncio.wait_for(receive(), self.patience_s)
            except asyncio.TimeoutError:
                raise _Refused(408, f"no more of the body came in {self.patience_s:g} s") from None
            total += len(message.get("body", b""))
            ended = message["type"] != "http.request" or not message.get("more_body", False)
            if total > self.most_bytes:
                raise _Refused(413, f"a body has at most {self.most_bytes} bytes")
            return message

        return limited


def host_of(url: str) -> str:
    """The host of a URL or of `//host:port`, without port and brackets; "" where there is none."""
    try:
        return (urlsplit(url).hostname or "").rstrip(".").lower()
    except ValueError:
        return ""


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach a host."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def allowed_hosts(host: str, more: Iterable[str]) -> frozenset[str]:
    """The Hosts that are served where one listens on `host`."""
    return frozenset(name.lower() for name in (*LOOPBACK, host, *more))


async def _answer(send: Send, status: int, why: str) -> None:
    body = json.dumps({"detail": why}).encode()
    headers = [(b"content-type", b"application/json"), (b"content-length", str(len(body)).encode()),
               (b"connection", b"close")]  # fmt: skip
    if status == 401:
        headers.append((b"www-authenticate", b"Bearer"))
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
