"""`nrdf serve`: the line over HTTP."""

from __future__ import annotations

import secrets
import signal
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional

from nrdf.commands.console import console, errors
from nrdf.commands.options import File, Folder, Metavar
from nrdf.io.bounds import Bounds, Count

if TYPE_CHECKING:
    from nrdf.cell.work_cell import WorkCell

_LONGEST_TOKEN = 1 << 10
_NEEDED = (
    "nrdf serve needs FastAPI and uvicorn, and Python 3.11 or newer: pip install 'nrdf[serve]'"
)


def serve(
    cell: Positional[File],
    out: Folder = Path("outbox"),
    inbox: Annotated[Path, Metavar("INBOX")] | None = None,
    host: str = "127.0.0.1",
    port: Annotated[int, Bounds(1, 65535)] = 8088,
    token_file: File | None = None,
    root: tuple[Folder, ...] = (),
    allow_host: tuple[str, ...] = (),
    max_upload_mb: Count = 200,
    keep_gb: Annotated[float, Bounds(0.0, above=True), Metavar("GB")] = 20.0,
    keep_days: Annotated[float, Bounds(0.0, above=True), Metavar("DAYS")] = 30.0,
    workers: Count | None = None,
) -> None:
    """Make checked programs of objects that are sent over HTTP.

    The same queue, store and outbox as `nrdf run`. POST /jobs queues a file; GET /jobs/N tells what
    became of it, /jobs/N/report, /picture and /programs give it; /events, /healthz and /metrics
    tell of the line; / shows it, /docs the interface. Only this machine can ask, unless --host says
    otherwise; then every request needs the token. Ends with Ctrl-C; the same command goes on.

    Example: nrdf serve cell.yaml --out outbox/

    Args:
        cell: Cell file, as `nrdf cell new` begins it.
        out: Folder for the results, and for the store of what was done.
        inbox: Folder to watch as well, as `nrdf run` does.
        host: Address to listen on; 0.0.0.0 for all of this machine's.
        port: Port to listen on.
        token_file: File with the token that requests must carry; without, where others can ask, one
            is made and shown.
        root: Folders whose files may be named by path, instead of being sent.
        allow_host: Further names that this machine is asked by.
        max_upload_mb: Largest file that is taken.
        keep_gb: Files that were sent are kept up to so much; then the oldest that are done go.
        keep_days: And for so long.
        workers: Worker processes; the cell's unless given.
    """
    from nrdf.cell.file import read_cell
    from nrdf.errors import ConfigError, DataError
    from nrdf.serve.hosts import is_loopback

    described = read_cell(cell)
    if not described.knowledge:
        raise ConfigError(f"{cell} names no knowledge file: say under knowledge what is to be done")
    for folder in (*root, *([] if inbox is None else [inbox])):
        if not folder.is_dir():
            raise DataError(f"{folder} is no folder; make it, or name another")
    token = _token(token_file)
    if token is None and not is_loopback(host):
        token = secrets.token_urlsafe(24)
        errors.print(f"requests need this token: Authorization: Bearer {token}")
    limits = (max_upload_mb * 10**6, host, port, token, allow_host, root, keep_gb, keep_days)
    _serve(described, cell, out, inbox, workers, *limits)


def _serve(
    cell: WorkCell,
    cell_file: Path,
    out: Path,
    inbox: Path | None,
    workers: int | None,
    most_bytes: int,
    host: str,
    port: int,
    token: str | None,
    allow_host: tuple[str, ...],
    roots: tuple[Path, ...],
    keep_gb: float,
    keep_days: float,
) -> None:
    from nrdf.errors import ConfigError, OutputError

    try:
        import uvicorn

        from nrdf.serve.connections import TimedProtocol
        from nrdf.serve.service import Service, create_app
    except ImportError:
        raise ConfigError(_NEEDED) from None
    from nrdf.serve.guard import Guard
    from nrdf.serve.hosts import allowed_hosts
    from nrdf.serve.line import open_line
    from nrdf.serve.summary import write_summary

    with open_line(cell, cell_file, out, inbox, workers) as line:
        inside = tuple(root.resolve() for root in roots)
        service = Service(line, cell.name, inside, keep_gb, keep_days)
        app = Guard(create_app(service), allowed_hosts(host, allow_host), token, most_bytes)
        config = uvicorn.Config(
            app, host, port, log_level="error", server_header=False, http=TimedProtocol,
            timeout_keep_alive=10, timeout_graceful_shutdown=3,
        )  # fmt: skip
        stepping = threading.Thread(target=service.run, daemon=True)
        stepping.start()
        console.print(f"http://{host}:{port}/ shows the line; Ctrl-C ends it")
        # uvicorn ends on SIGTERM, and then sends it again: to this, so that the end is whole.
        signal.signal(signal.SIGTERM, lambda *_: None)
        try:
            uvicorn.Server(config).run()
        except SystemExit:
            raise OutputError(f"cannot listen on {host}:{port}: is it in use?") from None
        finally:
            service.end()
            stepping.join(timeout=10)
            write_summary(out, line.store.rows(), cell.name)


def _token(file: Path | None) -> str | None:
    """The token in a file. Raises ConfigError for one that is too short to be one."""
    from nrdf.errors import ConfigError
    from nrdf.io.files import read_file

    if file is None:
        return None
    token = read_file(file, ConfigError, _LONGEST_TOKEN).decode("ascii", "replace").strip()
    if len(token) < 16 or not token.isprintable() or " " in token:
        raise ConfigError(f"{file} must hold a token of 16 characters or more, without spaces")
    return token
