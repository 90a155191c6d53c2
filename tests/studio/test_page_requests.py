"""What the page asks for: its files to all, the rest with a header that other sites cannot send."""

from __future__ import annotations

import json

import pytest

pytest.importorskip("viser", reason="pip install 'nrdf[studio]'")

from websockets.asyncio.server import Request
from websockets.datastructures import Headers

from nrdf.errors import NrdfError
from nrdf.studio.page_requests import HEADER, PageRequests


def asked(page, path, **headers):
    return page.respond(Request(path, Headers(headers)))


@pytest.fixture
def page():
    def refuse(values):
        raise NrdfError("no")

    made = PageRequests()
    made.answers |= {"name": lambda values: {"is": values["x"]}, "thumbnail": lambda values: b"PNG"}
    made.answers["refuse"] = refuse
    return made


def test_the_page_has_what_lies_over_it_before_visers_own_script(page):
    body = asked(page, "/?x").body
    assert body.index(b"prefers-color-scheme") < body.index(b"/nrdf/overlay.js")
    assert body.index(b"/nrdf/overlay.js") < body.index(b"<script data-p")
    assert b"own(" in asked(page, "/nrdf/overlay.js").body
    assert asked(page, "/nrdf/overlay.css").headers["Content-Type"].startswith("text/css")
    assert asked(page, "/assets/other.js") is None, "viser's"
    assert asked(page, "/", Upgrade="websocket") is None


def test_what_acts_needs_a_header(page):
    assert asked(page, "/nrdf/name?x=1").status_code == 403
    answer = asked(page, "/nrdf/name?x=1%202", **{HEADER: "1"})
    assert json.loads(answer.body) == {"is": "1 2"}
    assert asked(page, "/nrdf/thumbnail").headers["Content-Type"] == "image/png"
    assert asked(page, "/nrdf/name", **{HEADER: "1"}).status_code == 400
    assert asked(page, "/nrdf/refuse", **{HEADER: "1"}).body == b"no"
    assert asked(page, "/nrdf/../secret", **{HEADER: "1"}).status_code == 404
