"""By which names this machine may be asked, and by whose pages.

A browser on this machine can reach loopback too, so pages of other sites are told by their Origin,
and names that were rebound to this address by their Host.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Collection, Iterable, Sequence
from urllib.parse import urlsplit

LOOPBACK = ("127.0.0.1", "localhost", "::1")
_ALL = ("0.0.0.0", "::")
"""What is listened on where all addresses of this machine are."""


def allowed_hosts(host: str, more: Iterable[str]) -> frozenset[str]:
    """The names that are served where one listens on `host`, with `more` of them."""
    return frozenset(name.lower() for name in (*LOOPBACK, host, *more))


def serves(allowed: Collection[str], hosts: Sequence[str]) -> bool:
    """Whether a request with these Host headers is served: one alone, of an allowed name.

    Where all addresses are listened on, any address will do: only names can be rebound.
    """
    if len(hosts) != 1:
        return False
    asked = host_of(f"//{hosts[0]}")
    return asked in allowed or (is_address(asked) and any(name in allowed for name in _ALL))


def is_own_page(origin: str, host: str) -> bool:
    """Whether a page of that Origin came from the server that is asked as `host`, port and all."""
    try:
        parts = urlsplit(origin)
    except ValueError:
        return False
    return parts.scheme in ("http", "https") and parts.netloc.lower() == host.lower()


def host_of(url: str) -> str:
    """The host of a URL or of `//host:port`, without port and brackets; "" where there is none."""
    try:
        return (urlsplit(url).hostname or "").rstrip(".").lower()
    except ValueError:
        return ""


def is_address(host: str) -> bool:
    """Whether a host is given by its number."""
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach a host."""
    if is_address(host):
        return ipaddress.ip_address(host).is_loopback
    return host == "localhost"
