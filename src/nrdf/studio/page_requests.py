"""What the studio's page asks for beside viser's own: its files, and GETs that change or tell.

Every answer but files and pictures needs a header that a page of another site cannot send.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Mapping
from http import HTTPStatus
from importlib.resources import files
from pathlib import Path
from urllib.parse import parse_qsl, urlsplit

import viser
from websockets.asyncio.server import Request, Response
from websockets.datastructures import Headers

from nrdf.errors import NrdfError

log = logging.getLogger(__name__)

HEADER = "X-NRDF"
_PREFIX = "/nrdf/"
_TYPES = {".js": "text/javascript; charset=utf-8", ".css": "text/css; charset=utf-8"}
# Before viser's own script, which reads from the address whether to be dark.
_HEAD = """<script>
if (matchMedia("(prefers-color-scheme: dark)").matches && !location.search.includes("darkMode"))
  history.replaceState(null, "", "?darkMode");
matchMedia("(prefers-color-scheme: dark)").onchange = () => location.replace(location.pathname);
</script><link rel="stylesheet" href="/nrdf/overlay.css"><script src="/nrdf/overlay.js"></script>
"""

Answer = Callable[[Mapping[str, str]], "Mapping[str, object] | bytes"]
"""From the values in an address to what is sent: an object as JSON, or a PNG."""


class PageRequests:
    """answers: what is asked for, by its name in the address."""

    def __init__(self) -> None:
        self.answers: dict[str, Answer] = {}
        self._files: dict[str, bytes] = {}

    def respond(self, request: Request) -> Response | None:
        """The answer to a request that is not viser's, else None."""
        address = urlsplit(request.path)
        if "Upgrade" in request.headers:
            return None
        if address.path in ("/", "/index.html"):
            return _response(self._index(), "text/html; charset=utf-8")
        if not address.path.startswith(_PREFIX):
            return None
        name = address.path.removeprefix(_PREFIX)
        if name in ("overlay.js", "overlay.css"):
            return _response(self._file(name), _TYPES[Path(name).suffix])
        if name not in self.answers:
            return _response(b"", "text/plain", HTTPStatus.NOT_FOUND)
        if name != "thumbnail" and HEADER not in request.headers:
            return _response(b"", "text/plain", HTTPStatus.FORBIDDEN)
        try:
            answer = self.answers[name](dict(parse_qsl(address.query)))
        except (NrdfError, ValueError, KeyError) as error:
            return _response(str(error).encode(), "text/plain", HTTPStatus.BAD_REQUEST)
        if isinstance(answer, bytes):
            return _response(answer, "image/png")
        return _response(json.dumps(answer).encode(), "application/json")

    def _file(self, name: str) -> bytes:
        if name not in self._files:
            self._files[name] = (files("nrdf.studio") / "page" / name).read_bytes()
        return self._files[name]

    def _index(self) -> bytes:
        """viser's page, with what lies over it."""
        if "" not in self._files:
            page = (Path(viser.__file__).parent / "client" / "build" / "index.html").read_text()
            head = page.index("</head>") if "</head>" in page else 0
            first = page.find("<script")
            at = min(p for p in (head, first) if p >= 0)
            self._files[""] = (page[:at] + _HEAD + page[at:]).encode()
        return self._files[""]


def _response(body: bytes, kind: str, status: HTTPStatus = HTTPStatus.OK) -> Response:
    headers = Headers({"Content-Type": kind, "Content-Length": str(len(body))})
    headers["Cache-Control"], headers["Connection"] = "no-cache", "close"
    return Response(status.value, status.phrase, headers, body)
