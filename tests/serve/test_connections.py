"""Connections that send nothing, or half a head, are closed."""

from __future__ import annotations

import asyncio
import socket

import pytest

pytest.importorskip("uvicorn")
import uvicorn

from nrdf.serve import connections
from nrdf.serve.connections import TimedProtocol


async def app(scope, receive, send):
    await asyncio.sleep(0.4)  # longer than a head may take
    await send({"type": "http.response.start", "status": 204, "headers": []})
    await send({"type": "http.response.body", "body": b""})


async def ask(port, *parts):
    """What comes back until the server closes, of parts sent 0.1 s apart."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    for part in parts:
        writer.write(part)
        await asyncio.sleep(0.1)
    try:
        answer = await asyncio.wait_for(reader.read(), 20)
    except ConnectionError:  # it had closed before all parts were sent
        answer = b""
    writer.close()
    return answer


def test_a_head_must_come_in_time(monkeypatch):
    monkeypatch.setattr(connections, "HEAD_S", 0.3)

    async def run():
        listening = socket.socket()
        listening.bind(("127.0.0.1", 0))
        config = uvicorn.Config(app, http=TimedProtocol, log_level="error", lifespan="off",
                                timeout_keep_alive=1)  # fmt: skip
        server = uvicorn.Server(config)
        serving = asyncio.create_task(server.serve([listening]))
        port = listening.getsockname()[1]
        head = b"GET / HTTP/1.1\r\nHost: x\r\n\r\n"
        got = await asyncio.gather(
            ask(port), ask(port, *[b"G"] * 9), ask(port, head), ask(port, head[:9], head[9:]),
            ask(port, head, *[b""] * 5, head[:9]),
        )  # fmt: skip
        server.should_exit = True
        await serving
        return got

    nothing, dripping, whole, halves, again = asyncio.run(run())
    assert nothing == dripping == b""
    assert whole.startswith(b"HTTP/1.1 204") and halves.startswith(b"HTTP/1.1 204")
    assert again.count(b"HTTP/1.1 204") == 1
