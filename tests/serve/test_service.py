"""The line over HTTP."""

from __future__ import annotations

import threading
import time

import pytest

pytest.importorskip("fastapi")
pytest.importorskip("httpx")

from starlette.testclient import TestClient

from nrdf.serve import service as service_module
from nrdf.serve.guard import Guard
from nrdf.serve.hosts import allowed_hosts
from nrdf.serve.service import Service, create_app

JSON = {"content-type": "application/json"}


@pytest.fixture
def client(start, tmp_path):
    (tmp_path / "allowed").mkdir()
    service = Service(start(size=1), "cell 3", ((tmp_path / "allowed").resolve(),))
    thread = threading.Thread(target=service.run)
    thread.start()
    app = Guard(create_app(service), allowed_hosts("127.0.0.1", []), None, 2000)
    with TestClient(app, base_url="http://127.0.0.1", raise_server_exceptions=False) as made:
        made.service = service
        yield made
    service.end()
    thread.join()


def ended(client, number, seconds=30.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        said = client.get(f"/jobs/{number}").json()
        if said["state"] not in ("waiting", "running"):
            return said
        time.sleep(0.05)
    raise AssertionError(said)


def test_a_file_that_is_sent_becomes_a_job(client):
    sent = client.post("/jobs?name=chair-1.ply", content=b"ok")
    assert sent.status_code == 202 and sent.json()["name"] == "chair-1"
    said = ended(client, sent.json()["id"])
    assert said["state"] == "done" and said["figures"]["confidence"] == 0.5
    assert client.get("/jobs/1/programs").json() == []
    assert client.get("/jobs/1/programs/../object.json").status_code == 404
    bad = client.post("/jobs?name=b.ply", content=b"bad").json()["id"]
    assert ended(client, bad)["reason"] == "it is bad"
    assert client.get(f"/jobs/{bad}/report").json()["reasons"] == ["it is bad"]
    assert [row["id"] for row in client.get("/jobs?state=refused").json()] == [bad]
    assert "chair-1" in client.get("/").text
    assert 'nrdf_objects{state="done"} 1' in client.get("/metrics").text
    assert client.get("/healthz").json()["status"] == "ok"
    assert client.get("/openapi.json").json()["info"]["title"] == "nrdf: cell 3"


def test_a_path_is_taken_within_the_roots_alone_and_once(client, tmp_path):
    inside = tmp_path / "allowed" / "a.ply"
    inside.write_text("ok")
    first = client.post("/jobs", json={"path": str(inside)})
    assert first.status_code == 202
    assert client.post("/jobs", json={"path": str(inside)}).json()["id"] == first.json()["id"]
    (tmp_path / "allowed" / "link.ply").symlink_to(tmp_path / "out" / "line.sqlite")
    for path in ("/etc/passwd", str(tmp_path / "allowed"), f"{tmp_path}/allowed/../out/line.sqlite",
                 str(tmp_path / "allowed" / "link.ply"), "a\0b", ""):  # fmt: skip
        assert client.post("/jobs", json={"path": path}).status_code == 403, path


def test_fifty_at_once_are_queued_in_order_with_a_place(client):
    client.post("/jobs?name=slow.ply", content=b"sleep 2")
    answers = [client.post(f"/jobs?name=n{n}.ply", content=b"ok") for n in range(50)]
    assert {answer.status_code for answer in answers} == {202}
    places = [answer.json().get("place", -1) for answer in answers]
    assert places == sorted(places) and places[-1] >= 40
    assert ended(client, answers[-1].json()["id"], 60)["state"] == "done"


@pytest.mark.parametrize(
    ("method", "url", "more"),
    [
        ("GET", "/jobs/999999", {}),
        ("GET", "/jobs/-1", {}),
        ("GET", "/jobs/99999999999999999999999", {}),
        ("GET", "/jobs/x", {}),
        ("GET", "/jobs?limit=0", {}),
        ("GET", "/objects/done/..%2f..%2fline.sqlite/x", {}),
        ("GET", "/objects/done/%2e%2e/%2e%2e/line.sqlite", {}),
        ("GET", "/objects/.work/a/b", {}),
        ("GET", "/objects/done/a/%00", {}),
        ("GET", "/none", {}),
        ("DELETE", "/jobs/1", {}),
        ("POST", "/jobs", {"content": b"{", "headers": JSON}),
        ("POST", "/jobs", {"json": [1]}),
        ("POST", "/jobs", {"json": {"path": 3}}),
        ("POST", "/jobs", {"content": b"[" * 1500, "headers": JSON}),
        ("POST", "/jobs", {"content": b"cloud"}),
        ("POST", "/jobs?name=a.ply", {"content": b""}),
        ("POST", "/jobs?name=a.ply", {"content": b"x" * 3000}),
        ("POST", "/jobs?name=a.ply", {"content": iter([b"x" * 1500] * 2)}),
        ("POST", "/jobs?name=" + "a" * 500, {"content": b"x"}),
        ("GET", "/", {"headers": {"origin": "http://evil.example"}}),
        ("GET", "/", {"headers": {"host": "evil.example"}}),
    ],
)  # fmt: skip
def test_a_hostile_request_gets_4xx_and_leaves_nothing(client, tmp_path, method, url, more):
    answer = client.request(method, url, **more)
    assert 400 <= answer.status_code < 500, answer.text
    uploads = tmp_path / "out" / "uploads"
    assert not uploads.exists() or not list(uploads.iterdir())
    assert client.service.line.store.rows() == []


def test_a_full_queue_says_come_back_and_names_are_made_safe(client, tmp_path, monkeypatch):
    sent = client.post("/jobs?name=../../../etc/cron.d/x.p%00ly", content=b"ok")
    assert sent.status_code == 202 and ended(client, sent.json()["id"])["name"] == "x"
    assert not list(tmp_path.glob("**/cron.d"))
    monkeypatch.setattr(service_module, "MOST_WAITING", 0)
    assert client.post("/jobs?name=b.ply", content=b"ok").status_code == 429


def test_events_are_told_in_order(client):
    number = client.post("/jobs?name=a.ply", content=b"ok").json()["id"]
    ended(client, number)
    events = client.service.events_after(0)
    assert [(e["id"], e["state"]) for e in events] == [(number, "waiting"), (number, "done")]
    assert client.service.events_after(events[0]["sequence"]) == events[1:]


def test_a_file_that_is_sent_again_with_its_key_is_one_job(client):
    key = {"Idempotency-Key": "chair 7"}
    first, again = (client.post("/jobs?name=a.ply", content=b"ok", headers=key) for _ in range(2))
    other = client.post("/jobs?name=a.ply", content=b"ok")
    assert first.json()["id"] == again.json()["id"] != other.json()["id"]
    assert [a.status_code for a in (first, again, other)] == [202] * 3


def test_a_full_disk_and_too_much_that_is_kept_are_said(client, monkeypatch):
    def full(file):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    answer = client.post("/jobs?name=a.ply", content=b"ok")
    assert answer.status_code == 507 and "No space left" in answer.json()["detail"]
    monkeypatch.undo()
    client.service.kept = 10**12
    assert client.post("/jobs?name=a.ply", content=b"ok").status_code == 429
