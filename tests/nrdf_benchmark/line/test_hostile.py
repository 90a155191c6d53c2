"""The hostile client, against a server that refuses all or nothing."""

from __future__ import annotations

import random
import socketserver
import threading

import pytest

from nrdf_benchmark.line.hostile import KINDS, Attack, Target, attack


@pytest.fixture
def target():
    """A server that answers every connection with one status, which tests may change."""

    class Answer(socketserver.BaseRequestHandler):
        def handle(self):
            self.request.recv(1 << 20)
            self.request.sendall(self.server.answer)

    class Server(socketserver.ThreadingTCPServer):
        daemon_threads, request_queue_size = True, 64
        answer = b"HTTP/1.1 400 no\r\nContent-Length: 2\r\nConnection: close\r\n\r\nno"

    with Server(("127.0.0.1", 0), Answer) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        made = Target(server.server_address[1], "correct-horse", 1000)
        yield made, server
        server.shutdown()


def test_every_request_is_counted_by_its_kind_and_4xx_is_right(target):
    found = attack(target[0], 64, 2, 0)
    assert found.requests == 66 and not found.wrong
    assert set(found.answers) <= {*KINDS, "slow head", "slow body"}


def test_any_other_answer_is_wrong(target):
    target[1].answer = b"HTTP/1.1 200 OK\r\nContent-Length: 0\r\n\r\n"
    found = attack(target[0], 16, 0, 0)
    assert len(found.wrong) == found.requests == 16
    attack_ = Attack()
    for kind, status in (("wrong token", "closed"), ("garbage", "closed"), ("garbage", "500")):
        attack_.add(kind, status, b"x")
    assert [line.split(" to ")[0] for line in attack_.wrong] == [
        "wrong token: closed", "garbage: 500",
    ]  # fmt: skip


def test_only_the_wrong_token_lacks_the_right_one():
    rng, target = random.Random(0), Target(1, "correct-horse", 1000)
    for kind, make in KINDS.items():
        sent = [make(rng, target) for _ in range(30)]
        right = [b"Authorization: Bearer correct-horse\r\n" in one for one in sent]
        assert any(right) == (kind not in ("wrong token", "garbage")), kind
