"""Names that this machine is asked by, and pages that ask."""

from __future__ import annotations

import pytest

from nrdf.serve.hosts import allowed_hosts, host_of, is_loopback, is_own_page, serves


def test_hosts():
    assert host_of("//Host.:80") == "host" and host_of("//[") == ""
    assert is_loopback("127.0.0.9") and is_loopback("::1") and is_loopback("localhost")
    assert not is_loopback("0.0.0.0") and not is_loopback("example.org")


def test_names_can_be_rebound_and_addresses_cannot():
    here, everywhere = allowed_hosts("127.0.0.1", ["Line.local"]), allowed_hosts("0.0.0.0", [])
    assert serves(here, ["line.local:80"]) and serves(here, ["[::1]:8080"])
    assert not serves(here, ["192.0.2.7"]) and not serves(here, ["evil.example"])
    assert serves(everywhere, ["192.0.2.7:8080"]) and serves(everywhere, ["[2001:db8::1]:8080"])
    assert not serves(everywhere, ["evil.example"]) and not serves(everywhere, [])
    assert not serves(everywhere, ["localhost", "localhost"])


@pytest.mark.parametrize(
    ("origin", "own"),
    [
        ("http://127.0.0.1:8080", True),
        ("https://127.0.0.1:8080", True),
        ("http://127.0.0.1:9", False),
        ("http://localhost:8080", False),
        ("http://127.0.0.1:8080.evil.example", False),
        ("http://[", False),
        ("null", False),
    ],
)
def test_pages_of_this_server_and_of_others(origin, own):
    assert is_own_page(origin, "127.0.0.1:8080") == own
