"""A hostile client against `nrdf serve`: what it is answered, by kind of attack."""

from __future__ import annotations

import asyncio
import json
import random
import urllib.request
from collections import Counter, defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import quote

from nrdf_benchmark.line.kills import free_port, published, serving, wait_until

_CONNECTIONS, _SLOW = 16, 40
_ANSWER_S = 60.0
CLOSED = "closed"
"""What stands for an answer where the server closed the connection without one."""
_MAY_BE_CLOSED = ("garbage", "slow head", "header flood", "too large", "smuggled")
"""Kinds whose request is not over, or no request, when it is answered: the answer may be lost."""


@dataclass
class Attack:
    """What was answered. answers: by kind of attack, how often each status came; wrong: requests
    that were answered otherwise than with 4xx."""

    answers: dict[str, Counter[str]] = field(default_factory=lambda: defaultdict(Counter))
    wrong: list[str] = field(default_factory=list)

    @property
    def requests(self) -> int:
        """How many there were."""
        return sum(sum(counts.values()) for counts in self.answers.values())

    def add(self, kind: str, status: str, sent: bytes) -> None:
        self.answers[kind][status] += 1
        fine = status.startswith("4") or (status == CLOSED and kind in _MAY_BE_CLOSED)
        if not fine:
            self.wrong.append(f"{kind}: {status} to {sent[:200]!r}")


@dataclass(frozen=True)
class Target:
    """A server that needs a token. most_bytes: of a body."""

    port: int
    token: str
    most_bytes: int


def attack(target: Target, requests: int, slow: int, seed: int) -> Attack:
    """Send so many hostile requests on several connections at once, and `slow` that never end."""
    found = Attack()

    async def all_of_it() -> None:
        rng = random.Random(seed)
        kinds = list(KINDS)
        share = -(-requests // _CONNECTIONS)
        plans = [
            [(kind := rng.choice(kinds), KINDS[kind](rng, target)) for _ in range(share)]
            for _ in range(_CONNECTIONS)
        ]
        slowly = [("slow body" if n % 2 else "slow head", _slow(n % 2 == 1, target)) for n in
                  range(slow)]  # fmt: skip
        await asyncio.gather(
            *(_converse(target, plan, found) for plan in plans),
            *(_converse(target, [one], found) for one in slowly),
        )

    asyncio.run(all_of_it())
    return found


async def _converse(target: Target, plan: list[tuple[str, bytes]], found: Attack) -> None:
    """Send requests one after another, on one connection for as long as the server keeps it."""
    connection = None
    for kind, sent in plan:
        status, keep = CLOSED, False
        for _ in range(2):  # the server may have closed it since the last answer
            fresh = connection is None
            try:
                if connection is None:
                    connection = await asyncio.open_connection("127.0.0.1", target.port)
                status, keep = await asyncio.wait_for(_ask(*connection, sent), _ANSWER_S)
            except asyncio.TimeoutError:
                status, keep = "no answer", False
            except (ConnectionError, asyncio.IncompleteReadError, asyncio.LimitOverrunError):
                status, keep = CLOSED, False
            if (not keep or kind == "smuggled") and connection is not None:
                connection[1].close()
                connection = None
            if fresh or status != CLOSED:
                break
        found.add(kind, status, sent)
    if connection is not None:
        connection[1].close()


async def _ask(
    reader: asyncio.StreamReader, writer: asyncio.StreamWriter, sent: bytes
) -> tuple[str, bool]:
    """The status of the answer, and whether the connection may be used again."""
    writer.write(sent)
    head = (await reader.readuntil(b"\r\n\r\n")).decode("latin-1").lower()
    status = head.split(" ", 2)[1]
    length = next(
        (int(line[15:]) for line in head.splitlines() if line.startswith("content-length:")), 0
    )
    if not sent.startswith(b"HEAD "):
        await reader.readexactly(length)
    return status, "connection: close" not in head and "content-length" in head


def _request(
    target: Target, method: str = "GET", path: str = "/jobs", body: bytes = b"",
    headers: tuple[str, ...] = (), host: tuple[str, ...] | None = None, token: bool = True,
) -> bytes:  # fmt: skip
    hosts = (f"127.0.0.1:{target.port}",) if host is None else host
    lines = [f"{method} {path} HTTP/1.1", *(f"Host: {name}" for name in hosts), *headers]
    if token:
        lines.append(f"Authorization: Bearer {target.token}")
    if body:
        lines.append(f"Content-Length: {len(body)}")
    return "\r\n".join([*lines, "", ""]).encode("utf-8", "replace") + body


def _wrong_token(rng: random.Random, target: Target) -> bytes:
    token = target.token
    wrong = rng.choice([
        "", "Bearer", "Bearer ", f"Basic {token}", f"bearer{token}", f"Bearer {token[:-1]}",
        f"Bearer {token}x", f"Bearer {token.swapcase()}", f"Bearer {token}, {token}", "Bearer \xff",
        "Bearer " + "x" * rng.randrange(2000),
    ])  # fmt: skip
    path = rng.choice(["/", "/jobs", "/jobs/1", "/metrics", "/events", "/docs", "/openapi.json"])
    return _request(target, path=path, headers=(f"Authorization: {wrong}",), token=False)


def _foreign_host(rng: random.Random, target: Target) -> bytes:
    own = f"127.0.0.1:{target.port}"
    host = rng.choice([
        (), ("evil.example",), (own, own), (own, "evil.example"), ("",), ("[::1",),
        ("127.0.0.1.evil.example",), ("evil.example@127.0.0.1.x",), ("a" * rng.randrange(1, 3000),),
    ])  # fmt: skip
    return _request(target, host=host)


def _foreign_origin(rng: random.Random, target: Target) -> bytes:
    origin = rng.choice([
        "null", "http://evil.example", f"http://127.0.0.1:{target.port + 1}", "http://localhost",
        f"https://evil.example:{target.port}", "file://", f"http://127.0.0.1:{target.port}.evil.example",
        "http://[", "\t",
    ])  # fmt: skip
    method, path = rng.choice([("GET", "/jobs"), ("POST", "/jobs?name=a.ply"), ("GET", "/events")])
    body = b"x" if method == "POST" else b""
    return _request(target, method, path, body, (f"Origin: {origin}",))


def _path_trick(rng: random.Random, target: Target) -> bytes:
    up = rng.choice(["../", "..%2f", "%2e%2e/", "..%5c", "....//", "%252e%252e/", "..;/"])
    start = rng.choice([
        "/jobs/1/programs/", "/objects/done/", "/objects/done/chair/", "/objects/", "/jobs/",
        "/docs/", "/objects/done/%2e/", "/static/", "/jobs/1/picture/",
    ])  # fmt: skip
    end = rng.choice(["etc/passwd", "line.sqlite", "object.json", "%00", "a" * 3000, "\u202e", "."])
    path = start + up * rng.randrange(1, 12) + quote(end, safe="%/.")
    return _request(target, rng.choice(["GET", "GET", "POST", "HEAD"]), path)


def _no_such_job(rng: random.Random, target: Target) -> bytes:
    number = rng.choice(
        ["-1", "0", "999999999", "9" * 40, "1e3", "0x1", "NaN", "%27%20OR%201=1", "1.5"]
    )
    inner = rng.choice(["", "/report", "/picture", "/programs", "/programs/x", "/none"])
    return _request(target, path=f"/jobs/{number}{inner}")


def _wrong_query(rng: random.Random, target: Target) -> bytes:
    query = rng.choice([
        "/jobs?limit=0", "/jobs?limit=-1", "/jobs?limit=1e9", "/jobs?limit=99999999999999999999",
        "/jobs?state=%3Cscript%3E", "/jobs?state='", "/events?after=-1", "/events?after=x",
    ])  # fmt: skip
    return _request(target, path=query)


def _named_path(rng: random.Random, target: Target) -> bytes:
    body: object = {"path": rng.choice([
        "/etc/passwd", "/proc/self/environ", "/dev/zero", "", ".", "..", "~", "a\0b", "\ud800",
        "file:///etc/passwd", "/" * 5000, "//127.0.0.1/share", "|id", "x" * 70_000,
    ])}  # fmt: skip
    if rng.random() < 0.5:
        body = rng.choice([[], {}, 1, None, "x", {"path": 1}, {"path": None}, {"path": ["/etc"]}])
    text = json.dumps(body).encode()
    if rng.random() < 0.2:
        text = rng.choice([b"{", b"[" * 50_000, b'{"path": NaN', b"\xff\xfe", b'{"a":' * 3000])
    return _request(target, "POST", "/jobs", text, ("Content-Type: application/json",))


def _broken_upload(rng: random.Random, target: Target) -> bytes:
    parts = rng.choice([
        b"", b"--x\r\n", b"--x\r\nContent-Disposition: form-data; name=a; filename=../b\r\n\r\nx",
        b"--y--", rng.randbytes(500),
    ])  # fmt: skip
    kind = rng.choice(["multipart/form-data; boundary=x", "multipart/form-data", "application/xml",
                       "multipart/mixed; boundary=" + "b" * 500])  # fmt: skip
    query = rng.choice(["", "?name=", "?name=" + "n" * 201, "?nam=a.ply"])
    return _request(target, "POST", f"/jobs{query}", parts, (f"Content-Type: {kind}",))


def _too_large(rng: random.Random, target: Target) -> bytes:
    most = target.most_bytes
    if rng.random() < 0.02:  # said to be unknown, and too much as it comes
        head = _request(target, "POST", "/jobs?name=a.ply", b"", ("Transfer-Encoding: chunked",))
        return head + b"%x\r\n" % (most + 1) + bytes(most + 1) + b"\r\n0\r\n\r\n"
    said = rng.choice([f"{most + 1}", "9" * 30, "-1", "1e3", "0x10", " ", "1, 2", "٣"])
    return _request(target, "POST", "/jobs?name=a.ply", b"", (f"Content-Length: {said}",))


def _header_flood(rng: random.Random, target: Target) -> bytes:
    many = rng.choice([
        tuple(f"X-{n}: {'v' * 50}" for n in range(3000)), ("X: " + "v" * 200_000,),
        ("X" * 100_000 + ": v",), ("Cookie: " + "a=b; " * 30_000,),
    ])  # fmt: skip
    return _request(target, headers=many)


def _wrong_method(rng: random.Random, target: Target) -> bytes:
    method = rng.choice(
        ["PUT", "DELETE", "PATCH", "TRACE", "CONNECT", "OPTIONS", "PROPFIND", "get", "X" * 50]
    )
    return _request(target, method, rng.choice(["/jobs", "/jobs/1", "/metrics", "/", "*"]))


def _smuggled(rng: random.Random, target: Target) -> bytes:
    headers = rng.choice([
        ("Content-Length: 3", "Transfer-Encoding: chunked"), ("X: a\0b",), (" folded: x",),
        ("Content-Length: 3", "Content-Length: 5"), ("Transfer-Encoding: gzip, chunked",),
        ("Transfer-Encoding: chunked", "Transfer-Encoding: x"), ("Transfer-Encoding : chunked",),
    ])  # fmt: skip
    return _request(target, "POST", "/jobs", b"", headers) + b"abc"


def _garbage(rng: random.Random, target: Target) -> bytes:
    return rng.choice([
        rng.randbytes(rng.randrange(1, 2000)) + b"\r\n\r\n", b"\r\n\r\n\r\n\r\nX\r\n\r\n",
        b"GET / HTTP/0.9\r\n\r\n", b"GET / HTTP/9.9\r\nHost: x\r\n\r\n", b"GET  /\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + rng.randbytes(200) + b"\r\n\r\n",
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", b"GET http://[/ HTTP/1.1\r\nHost: x\r\n\r\n",
    ])  # fmt: skip


def _slow(body: bool, target: Target) -> bytes:
    """A request of which the rest never comes."""
    if body:
        return _request(target, "POST", "/jobs?name=a.ply", b"", ("Content-Length: 100",)) + b"x"
    return b"GET /jobs HTTP/1.1\r\nHost: "


KINDS: dict[str, Callable[[random.Random, Target], bytes]] = {
    "wrong token": _wrong_token, "foreign host": _foreign_host, "foreign origin": _foreign_origin,
    "path tricks": _path_trick, "no such job": _no_such_job, "wrong query": _wrong_query,
    "named path": _named_path, "broken upload": _broken_upload, "too large": _too_large,
    "header flood": _header_flood, "wrong method": _wrong_method, "smuggled": _smuggled,
    "garbage": _garbage,
}  # fmt: skip


def attack_service(cell: Path, folder: Path, requests: int, seed: int) -> tuple[Attack, str]:
    """Attack `nrdf serve` with light workers, which has done one job; and how it is after that."""
    folder.mkdir(parents=True)
    (folder / "token").write_text("correct-horse-battery")
    target = Target(free_port(), "correct-horse-battery", 10**6)
    with serving(
        cell, folder / "outbox", target.port, "--token-file", str(folder / "token"),
        "--max-upload-mb", "1",
    ) as url:  # fmt: skip
        asked = _request(target, "POST", "/jobs?name=chair.csv", b"1,2,3\n")
        asyncio.run(_converse(target, [("good", asked)], Attack()))
        wait_until(lambda: published(folder / "outbox") == 1)
        found = attack(target, requests, _SLOW, seed)
        with urllib.request.urlopen(f"{url}/healthz") as answer:
            said = json.load(answer)["status"]
        kept = sum(1 for path in (folder / "outbox" / "uploads").rglob("*") if path.is_file())
    return found, f"{said}, {published(folder / 'outbox')} job, {kept} file kept"
