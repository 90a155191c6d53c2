"""What stands before the service: who may ask (`nrdf.serve.hosts`), and how much."""

from __future__ import annotations

import asyncio
import hmac
import json
from collections.abc import Awaitable, Callable, MutableMapping
from dataclasses import dataclass, field
from typing import Any

from starlette.exceptions import HTTPException

from nrdf.serve.hosts import is_own_page, serves

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Message, Receive, Send], Awaitable[None]]

_OPEN = ("/healthz",)
"""Paths that need no token: what a load balancer asks."""
_LARGEST_HEAD = 1 << 14


class _Refused(HTTPException):
    """A request that ends here; within the application it is answered as its own errors are."""


@dataclass(frozen=True)
class Guard:
    """Refuses requests before `app` sees them: 400 for a foreign Host, 403 for a foreign Origin,
    401 without the token, 431 for large headers, 413 for a body above `most_bytes`, 408 for one
    that does not come, 429 where more than `most_requests` are under way."""

    app: App
    hosts: frozenset[str]
    token: str | None
    most_bytes: int
    patience_s: float = 30.0
    most_requests: int = 500
    _under_way: list[None] = field(default_factory=list)

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

        self._under_way.append(None)
        try:
            self._check(scope)
            await self.app(scope, self._limited(receive), noting)
        except _Refused as refused:
            if not begun:
                await _answer(send, refused.status_code, refused.detail)
        finally:
            self._under_way.pop()

    def _check(self, scope: Message) -> None:
        if len(self._under_way) > self.most_requests:
            raise _Refused(429, "too many requests at once; come back later")
        head = sum(len(name) + len(value) for name, value in scope["headers"])
        if head + len(scope["raw_path"]) + len(scope["query_string"]) > _LARGEST_HEAD:
            raise _Refused(431, f"path and headers have at most {_LARGEST_HEAD} bytes together")
        headers: dict[str, list[str]] = {}
        for name, value in scope["headers"]:
            headers.setdefault(name.decode("latin-1").lower(), []).append(value.decode("latin-1"))
        hosts = headers.get("host", [])
        if not serves(self.hosts, hosts):
            raise _Refused(400, "this Host is not served; --allow-host adds one")
        for origin in headers.get("origin", []):
            if not is_own_page(origin, hosts[0]):
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


async def _answer(send: Send, status: int, why: str) -> None:
    body = json.dumps({"detail": why}).encode()
    headers = [(b"content-type", b"application/json"), (b"content-length", str(len(body)).encode()),
               (b"connection", b"close")]  # fmt: skip
    if status == 401:
        headers.append((b"www-authenticate", b"Bearer"))
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
