"""What is refused before the service sees it."""

from __future__ import annotations

import asyncio

import pytest

pytest.importorskip("fastapi")

from nrdf.serve.guard import Guard
from nrdf.serve.hosts import allowed_hosts

TOKEN = "0123456789abcdef"


async def echo(scope, receive, send):
    more = True
    while more:
        more = (await receive()).get("more_body", False)
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b"ok"})


def status(headers, path="/", bodies=(b"",), token=None, wait=0.0):
    """The status of a request to a guard of at most 10 bytes and 0.2 s."""
    parts, sent = list(bodies), []

    async def receive():
        await asyncio.sleep(wait)
        return {"type": "http.request", "body": parts.pop(0), "more_body": bool(parts)}

    async def send(message):
        sent.append(message)

    raw = [(k.encode(), v.encode("latin-1")) for k, v in headers]
    scope = {"type": "http", "path": path, "headers": raw, "raw_path": path.encode(),
             "query_string": b""}  # fmt: skip
    guard = Guard(echo, allowed_hosts("127.0.0.1", ["line.local"]), token, 10, 0.2)
    try:
        asyncio.run(guard(scope, receive, send))
    except Exception as error:  # an application answers these itself
        return error.status_code
    return sent[0]["status"]


HOST = ("host", "127.0.0.1:8088")


@pytest.mark.parametrize(
    ("headers", "expected"),
    [
        ([HOST], 200),
        ([("host", "LOCALHOST")], 200),
        ([("host", "[::1]:8088")], 200),
        ([("host", "line.local")], 200),
        ([], 400),
        ([HOST, HOST], 400),
        ([("host", "evil.example")], 400),
        ([("host", "127.0.0.1.evil.example")], 400),
        ([("host", "[::1")], 400),
        ([HOST, ("x", "v" * 20_000)], 431),
        ([HOST, ("origin", "http://127.0.0.1:8088")], 200),
        ([HOST, ("origin", "http://evil.example")], 403),
        ([HOST, ("origin", "http://127.0.0.1:9")], 403),
        ([HOST, ("origin", "null")], 403),
        ([HOST, ("content-length", "11")], 413),
        ([HOST, ("content-length", "-1")], 413),
    ],
)
def test_hosts_origins_and_sizes(headers, expected):
    assert status(headers) == expected


def test_a_token_is_needed_everywhere_but_for_health():
    assert status([HOST], token=TOKEN) == 401
    assert status([HOST, ("authorization", f"Bearer {TOKEN}")], token=TOKEN) == 200
    for wrong in (TOKEN, f"Bearer {TOKEN} ", "Bearer ", "Bearer é", f"bearer {TOKEN}"):
        assert status([HOST, ("authorization", wrong)], token=TOKEN) == 401
    assert status([HOST], "/healthz", token=TOKEN) == 200
    assert status([HOST], "/healthz/..", token=TOKEN) == 401


def test_a_body_that_lies_about_its_size_or_does_not_come_is_refused():
    assert status([HOST], bodies=(b"12345", b"12345")) == 200
    assert status([HOST, ("content-length", "3")], bodies=(b"12345", b"123456")) == 413
    assert status([HOST], bodies=(b"1", b"2"), wait=0.5) == 408
