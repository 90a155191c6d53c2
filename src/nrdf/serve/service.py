"""The line over HTTP: jobs in, reports, pictures and programs out, events and figures beside."""

from __future__ import annotations

import asyncio
import json
import math
import os
import threading
import time
from collections import deque
from collections.abc import AsyncIterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

from fastapi import FastAPI, Header, HTTPException, Query, Request
from fastapi.responses import FileResponse, HTMLResponse, PlainTextResponse, StreamingResponse

from nrdf.errors import DataError
from nrdf.io.result_folder import REPORT
from nrdf.reports.html import html_text
from nrdf.reports.job_folder import PICTURE
from nrdf.serve.line import Line
from nrdf.serve.outbox import OBJECT
from nrdf.serve.store import OUTCOMES, ObjectRow
from nrdf.serve.summary import page_content
from nrdf.serve.uploads import Uploads
from nrdf.serve.watch import ArrivedFile
from nrdf.serve.work import PROGRAMS

UPLOADS = "uploads"
State = Literal["waiting", "running", "done", "look-at", "refused"]
MOST_WAITING = 10_000
_STEP_S, _LOOK_S, _CLEAR_S, _KEPT_EVENTS, _MOST_LISTED = 0.1, 0.3, 60.0, 2000, 1000
_LONGEST_NAME = 200


@dataclass
class Service:
    """A line that a thread steps, and what HTTP asks of it.

    roots: folders whose files may be named by path. keep_gb, keep_days: how much of what was sent
    is kept, and for how long. failed: why the line has ended, "" while it runs.
    """

    line: Line
    name: str
    roots: Sequence[Path] = ()
    keep_gb: float = 20.0
    keep_days: float = 30.0
    failed: str = ""
    _events: deque[dict[str, Any]] = field(default_factory=lambda: deque(maxlen=_KEPT_EVENTS))
    _sequence: int = 0
    kept: int = 0
    _ended: threading.Event = field(default_factory=threading.Event)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def run(self) -> None:
        """Step the line until `end`; for a thread of its own."""
        self.line.on_end = lambda row: self._tell(row)
        cleared = -math.inf
        try:
            while not self._ended.wait(_STEP_S):
                self.line.step()
                if time.monotonic() - cleared > _CLEAR_S:
                    self.uploads.clear(self.line.store.open_sources())
                    self.kept, cleared = self.uploads.bytes(), time.monotonic()
        except Exception as error:  # told to whoever asks; the store is as it was
            self.failed = f"{type(error).__name__}: {error}"

    def end(self) -> None:
        self._ended.set()

    @cached_property
    def uploads(self) -> Uploads:
        folder = self.line.outbox.folder / UPLOADS
        return Uploads(folder, int(1e9 * self.keep_gb), 86400 * self.keep_days)

    def require_space(self) -> None:
        """Raise HTTPException where more is kept than may be, since it still waits."""
        if self.kept > self.uploads.most_bytes:
            raise HTTPException(429, f"{self.keep_gb:g} GB of files are kept; come back later")

    def take(self, path: Path, label: str) -> ObjectRow:
        """Queue a file; the row of the same one where it is known. Raises HTTPException."""
        if self.line.store.counts()["waiting"] >= MOST_WAITING:
            raise HTTPException(429, f"{MOST_WAITING} objects wait; come back later")
        found = path.stat()
        file = ArrivedFile(path, label, found.st_size, found.st_mtime_ns)
        number = self.line.take(file)
        row = (
            self.line.store.find(str(path.absolute()), found.st_size, found.st_mtime_ns)
            if number is None
            else self.line.store.row(number)
        )
        assert row is not None
        self._tell(row)
        return row

    def within_roots(self, path: str) -> Path:
        """A file that is named by path. Raises HTTPException for one outside the allowed roots."""
        with suppress(OSError, ValueError):
            place = Path(os.path.realpath(path))
            if place.is_file() and any(place.is_relative_to(root) for root in self.roots):
                return place
        raise HTTPException(403, "no file within the allowed roots; --root adds one")

    def describe(self, row: ObjectRow) -> dict[str, Any]:
        """What is said of an object."""
        said = {
            "id": row.id, "name": row.name, "state": row.state, "reason": row.reason,
            "attempts": row.attempts, "arrived_s": row.arrived_s, "ended_s": row.ended_s,
            "figures": dict(row.figures),
        }  # fmt: skip
        if row.state == "waiting":
            said["place"] = self.line.store.place(row)
        return said

    def events_after(self, sequence: int) -> list[dict[str, Any]]:
        with self._lock:
            return [event for event in self._events if event["sequence"] > sequence]

    def _tell(self, row: ObjectRow) -> None:
        with self._lock:
            self._sequence += 1
            event = {"sequence": self._sequence, "id": row.id, "state": row.state}
            self._events.append({**event, "reason": row.reason})

    def row(self, number: int) -> ObjectRow:
        row = self.line.store.row(number) if 0 <= number < 2**62 else None
        if row is None:
            raise HTTPException(404, f"no job {number}")
        return row

    def file(self, row: ObjectRow, *inner: str) -> Path:
        """A file of an object's folder. Raises HTTPException where it is not there."""
        if row.state not in OUTCOMES:
            raise HTTPException(409, f"job {row.id} is {row.state}")
        return self._inside(self.line.outbox.place(row.name, row.state), *inner)

    def _inside(self, folder: Path, *inner: str) -> Path:
        with suppress(OSError, ValueError):
            place = Path(os.path.realpath(folder.joinpath(*inner)))
            if place.is_relative_to(os.path.realpath(folder)) and place.is_file():
                return place
        raise HTTPException(404, "there is no such file")


def create_app(service: Service) -> FastAPI:
    """The endpoints. Put `nrdf.serve.guard.Guard` before them."""
    app = FastAPI(title=f"nrdf: {service.name}", description=__doc__ or "", redirect_slashes=False)

    @app.post("/jobs", status_code=202)
    async def add(
        request: Request,
        name: str = Query("", max_length=_LONGEST_NAME),
        idempotency_key: str | None = Header(None, max_length=_LONGEST_NAME),
    ) -> Any:
        """Queue an object: the file as the body, with ?name=chair-1.ply, or JSON {"path": ...}.

        With an Idempotency-Key a file may be sent again, when no answer came: it is one job.
        """
        if request.headers.get("content-type", "").startswith("application/json") and not name:
            try:
                path = json.loads(await request.body())["path"]
                assert isinstance(path, str)
            except (ValueError, KeyError, TypeError, AssertionError, RecursionError):
                why = 'give JSON {"path": "..."}, or ?name= and a body'
                raise HTTPException(422, why) from None
            place = service.within_roots(path)
            return service.describe(await asyncio.to_thread(service.take, place, place.name))
        if not name:
            raise HTTPException(422, "give ?name=, with the ending of the file: chair-1.ply")
        service.require_space()
        place = service.uploads.place(name, idempotency_key)
        try:
            if place.exists():
                async for _ in request.stream():
                    pass  # it was sent before, by a client that did not hear the answer
            else:
                with service.uploads.receiving(place) as file:
                    async for chunk in request.stream():
                        file.write(chunk)
                service.kept += place.stat().st_size
        except DataError as error:
            raise HTTPException(422, str(error)) from None
        except OSError as error:
            raise HTTPException(507, f"cannot keep the file: {error.strerror}") from None
        return service.describe(await asyncio.to_thread(service.take, place, place.name))

    @app.get("/jobs")
    def jobs(state: State | None = None, limit: int = Query(100, ge=1, le=_MOST_LISTED)) -> Any:
        """The latest objects, those in a state where one is given."""
        return [service.describe(row) for row in service.line.store.rows(state, limit)]

    @app.get("/jobs/{number}")
    def job(number: int) -> Any:
        """An object: its state, its place in the queue, its reason."""
        return service.describe(service.row(number))

    @app.get("/jobs/{number}/report")
    def report(number: int) -> FileResponse:
        """report.json of its job, or what was wrong with it."""
        row = service.row(number)
        name = REPORT if "paths" in row.figures else OBJECT
        return FileResponse(service.file(row, name), media_type="application/json")

    @app.get("/jobs/{number}/picture")
    def picture(number: int) -> FileResponse:
        return FileResponse(service.file(service.row(number), PICTURE))

    @app.get("/jobs/{number}/programs")
    def programs(number: int) -> list[str]:
        """The names of its programs."""
        row = service.row(number)
        folder = service.file(row, OBJECT).parent / PROGRAMS
        files = folder.rglob("*") if folder.is_dir() else ()
        return sorted(p.relative_to(folder).as_posix() for p in files if p.is_file())

    @app.get("/jobs/{number}/programs/{name:path}")
    def program(number: int, name: str) -> FileResponse:
        folder = service.file(service.row(number), OBJECT).parent / PROGRAMS
        file = service._inside(folder, name)
        return FileResponse(file, media_type="application/octet-stream")

    @app.get("/objects/{outcome}/{name}/{inner:path}")
    def object_file(outcome: str, name: str, inner: str) -> FileResponse:
        """A file of an object's folder, as the status page links to it."""
        folder = service.line.outbox.folder
        if outcome not in OUTCOMES:
            raise HTTPException(404, "there is no such file")
        return FileResponse(service._inside(folder / outcome, name, inner))

    @app.get("/events")
    async def events(request: Request, after: int = Query(0, ge=0)) -> StreamingResponse:
        """Server-sent events: an object was queued, or has its outcome."""

        async def stream() -> AsyncIterator[str]:
            last, said = after, time.monotonic()
            while not service._ended.is_set() and not await request.is_disconnected():
                for event in service.events_after(last):
                    last = event["sequence"]
                    yield f"id: {last}\ndata: {json.dumps(event)}\n\n"
                    said = time.monotonic()
                if time.monotonic() - said > 15:
                    yield ": still here\n\n"
                    said = time.monotonic()
                await asyncio.sleep(_LOOK_S)

        return StreamingResponse(stream(), media_type="text/event-stream")

    @app.get("/healthz")
    def health() -> Any:
        if service.failed:
            raise HTTPException(503, service.failed)
        return {"status": "paused" if service.line.paused else "ok", "why": service.line.paused}

    @app.get("/metrics", response_class=PlainTextResponse)
    def metrics() -> str:
        """Figures for Prometheus."""
        lines = ["# TYPE nrdf_objects gauge"]
        counts = service.line.store.counts()
        lines += [f'nrdf_objects{{state="{state}"}} {n}' for state, n in counts.items()]
        pool = service.line.pool
        lines += ["# TYPE nrdf_worker_restarts_total counter",
                  f"nrdf_worker_restarts_total {pool.restarts}",
                  "# TYPE nrdf_workers gauge", f"nrdf_workers {pool.size}",
                  "# TYPE nrdf_workers_resident_bytes gauge",
                  f"nrdf_workers_resident_bytes {1e6 * pool.resident_mb():.0f}"]  # fmt: skip
        return "\n".join(lines) + "\n"

    @app.get("/", response_class=HTMLResponse)
    def page() -> str:
        """The status page."""
        store = service.line.store
        rows, counts = store.rows(most=_MOST_LISTED), store.counts()
        return html_text("line.html", page_content(rows, service.name, 10, "objects/", counts))

    return app
