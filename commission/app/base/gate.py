"""The gate: decides about each request, plain or websocket, before viser sees it. It decides only, and talks to nobody.

What makes a request ours: the name by which we are called, the page it comes from, and the token or its cookie.
"""

from __future__ import annotations

import hashlib
import hmac
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from http import HTTPStatus
from types import MappingProxyType
from typing import NamedTuple
from urllib.parse import parse_qs, unquote, urlsplit

from websockets.datastructures import Headers

LONGEST_PATH = 1_000
"""Letters of a path; the page has none beyond 20."""
LONGEST_NAME = 200
"""Letters between two slashes of a path; file systems refuse names beyond 255 bytes with an error."""
METHODS = ("GET", "HEAD", "OPTIONS")

_ENTERED = (
    """<!doctype html><meta charset="utf-8"><meta http-equiv="refresh" content="0;url=/"><title>Commission</title>"""
)
"""Answer to a right token. A redirect would do, but after a link in a mail or a chat the browser counts its target as
reached from there and withholds a strict cookie; a page of our own that moves on does not have this problem."""


class GateAnswer(NamedTuple):
    """What the gate says in viser's place."""

    status: HTTPStatus
    text: str
    headers: Mapping[str, str] = MappingProxyType({})


@dataclass(frozen=True, slots=True, kw_only=True)
class AccessGate:
    """Decides about each request."""

    token: str | None
    """Secret that a browser has to bring; None when only this computer can connect."""

    host_names: frozenset[str] | None
    """Names by which a browser may call us; None for any (then the token protects: a cookie belongs to one name).

    On loopback a foreign name that resolves to 127.0.0.1 would otherwise make its page one of ours (DNS rebinding).
    """

    cookie_name: str
    """Cookies are shared by all ports of a computer, so the name contains the port."""

    public_origin: str | None = None
    """`https://name` of a proxy in front of us; None when there is none."""

    def answer(self, method: str, path: str, headers: Headers) -> GateAnswer | None:
        """Answer of the gate itself; None lets the request through to viser.

        Parameters
        ----------
        method : of the request, in capitals.
        path : asked for, with its query.
        headers : of the request; the origin and the cookie are looked at.
        """
        own = _malformed(path) or self._refused_sender(headers) or self._asked_for_token(path, headers)
        if own is not None or method in ("GET", "HEAD"):
            return own
        allowed = {"Allow": ", ".join(METHODS)}
        if method == "OPTIONS":
            return GateAnswer(HTTPStatus.NO_CONTENT, "", allowed)
        return GateAnswer(HTTPStatus.METHOD_NOT_ALLOWED, f"Expected {', '.join(METHODS)}.\n", allowed)

    def brings_secret(self, path: str, headers: Headers) -> bool:
        """Whether a request can be a guess: it has a token or our cookie, right or wrong."""
        if self.token is None:
            return False
        return _given_token(path) is not None or next(_cookies(headers, self.cookie_name), None) is not None

    def _refused_sender(self, headers: Headers) -> GateAnswer | None:
        """Refusal of a request that does not come from our own page or from the address bar."""
        hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
        if len(hosts) != 1 or len(origins) > 1:
            return GateAnswer(HTTPStatus.BAD_REQUEST, "Expected one Host and at most one Origin header.\n")
        if self.host_names is not None and name_of(hosts[0]) not in self.host_names:
            return GateAnswer(HTTPStatus.FORBIDDEN, "This page is served to this computer only, by its own names.\n")
        if origins and not (_same_origin(origins[0], hosts[0]) or origins[0].lower() == self.public_origin):
            return GateAnswer(HTTPStatus.FORBIDDEN, "This page does not answer pages of another origin.\n")
        return None

    def _asked_for_token(self, path: str, headers: Headers) -> GateAnswer | None:
        """Cookie for a right token, refusal of a wrong or missing one, None for a browser that has the cookie."""
        if self.token is None:
            return None
        given, kept = _given_token(path), _cookie_value(self.token)
        if given is None and any(_same_secret(found, kept) for found in _cookies(headers, self.cookie_name)):
            return None
        if given is None or not _same_secret(given, self.token):
            text = "Open the address that ends with the right ?token=... once.\n"
            return GateAnswer(HTTPStatus.UNAUTHORIZED, text)
        cookie = f"{self.cookie_name}={_cookie_value(self.token)}; HttpOnly; SameSite=Strict; Path=/"
        if self.public_origin is not None and self.public_origin == f"https://{headers['Host'].lower()}":
            cookie += "; Secure"
        return GateAnswer(HTTPStatus.OK, _ENTERED, {"Set-Cookie": cookie, "Content-Type": "text/html; charset=utf-8"})


def _malformed(path: str) -> GateAnswer | None:
    """Refusal of a path that no page has and that a file system would choke on."""
    plain = unquote(path.partition("?")[0], errors="replace")
    if len(plain) > LONGEST_PATH or any(len(part) > LONGEST_NAME for part in plain.replace("\\", "/").split("/")):
        return GateAnswer(HTTPStatus.REQUEST_URI_TOO_LONG, f"Expected a path of at most {LONGEST_PATH} letters.\n")
    if not plain.isprintable():
        return GateAnswer(HTTPStatus.BAD_REQUEST, "Expected a path of printable letters.\n")
    return None


def _cookie_value(token: str) -> str:
    """What a browser keeps in place of the token: safe characters whatever the token is made of."""
    return hashlib.sha256(f"commission page {token}".encode()).hexdigest()


def _given_token(path: str) -> str | None:
    """Return the token that an address ends with; of several the last."""
    given = parse_qs(path.partition("?")[2], keep_blank_values=True).get("token")
    return None if given is None else given[-1]


def _cookies(headers: Headers, name: str) -> Iterator[str]:
    """Values of the cookies of this name, among others of this computer that may be of any form."""
    pairs = (pair.strip().partition("=") for line in headers.get_all("Cookie") for pair in line.split(";"))
    return (value for key, _, value in pairs if key == name)


def _same_secret(found: str, expected: str) -> bool:
    """Whether two texts agree, in a time that does not tell how much of them does."""
    return hmac.compare_digest(found.encode(errors="replace"), expected.encode())


def name_of(host_header: str) -> str | None:
    """Host name without its port, lower case; None when there is no such thing in the header."""
    try:
        return urlsplit(f"//{host_header}").hostname
    except ValueError:
        return None


def _same_origin(origin: str, host_header: str) -> bool:
    """Whether a page of this origin was served by us (https: a proxy in front of us may speak TLS)."""
    scheme, separator, authority = origin.lower().partition("://")
    return bool(separator) and scheme in ("http", "https") and authority == host_header.lower()
