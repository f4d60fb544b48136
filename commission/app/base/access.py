"""Who is let in, and by which address: tokens, and what is printed for people to open."""

from __future__ import annotations

import ipaddress
import logging
import os
import secrets
import socket
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from commission.errors import ServerError

log = logging.getLogger(__name__)

TOKEN_VARIABLE = "COMMISSION_TOKEN"  # noqa: S105  (the name of a variable)
MADE_BYTES = 24
"""Random bytes of a token that the program makes: 192 bits, which nobody guesses."""
CLEAR_TEXT = (
    "anyone on this network can read the token, since there is no TLS; "
    "see 'Show it to others' in the README for a proxy with TLS (--public-url)"
)

_SOMEWHERE = {socket.AF_INET: "192.0.2.1", socket.AF_INET6: "2001:db8::1"}
"""Addresses for documentation: a route towards them says by which interface this computer talks to others."""


@dataclass(frozen=True, slots=True)
class Token:
    """A secret that browsers bring."""

    text: str
    """The secret itself."""
    is_made: bool = False
    """Whether the program has made it; nobody knows such a one unless it is printed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Access:
    """Where the page is served and what a browser must bring."""

    host: str = "127.0.0.1"
    """Address or name of the interface to listen on."""
    port: int = 8080
    """TCP port; 0 takes a free one."""
    token: Token | None = None
    """Secret; None when only this computer can connect."""
    public_url: str | None = None
    """Address of a proxy with TLS in front of the page; None when there is none."""
    files: tuple[Path, ...] = ()
    """Folders from which the page may read beside the project's own, when other computers are let in."""
    networks: tuple[str, ...] = ()
    """Networks in which a browser may name live sources beside the private ones, each as `ADDRESS/BITS`."""

    @property
    def lets_others_in(self) -> bool:
        """Whether a browser on another computer can reach the page."""
        return self.public_url is not None or not is_loopback(self.host)


def chosen_token(text: str | None, file: Path | None, environment: Mapping[str, str] = os.environ) -> Token | None:
    """Return the token that was chosen on the command line, in a file or in the environment; None when none was.

    Parameters
    ----------
    text : the token itself, or `auto` for one that is made here.
    file : a file whose first line is the token.
    environment : looked at when neither is given.

    Raises
    ------
    ServerError
        both are given, or the file holds none.
    """
    if text is not None and file is not None:
        raise ServerError("both --token and --token-file are given; expected one of them")
    if file is not None:
        return Token(_first_line(file))
    if text is None:
        text = environment.get(TOKEN_VARIABLE)
    if text == "auto":
        return Token(secrets.token_urlsafe(MADE_BYTES), is_made=True)
    return None if text is None else Token(text)


def _first_line(file: Path) -> str:
    """Read a token from a file."""
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError) as error:
        reason = (error.strerror or "cannot be read").lower() if isinstance(error, OSError) else "is no text"
        raise ServerError(f"{file}: {reason}; expected a file whose first line is the token") from error
    if not lines or not lines[0].strip():
        raise ServerError(f"{file}: the first line is empty; expected the token")
    if os.name == "posix" and file.stat().st_mode & 0o077:
        log.warning("%s can be read by other users of this computer; expected: chmod 600", file)
    return lines[0].strip()


def is_loopback(host: str) -> bool:
    """Whether only this computer can reach what listens on an address or name."""
    try:
        address = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)[0][4][0]
        return ipaddress.ip_address(str(address).partition("%")[0]).is_loopback
    except (OSError, UnicodeError, ValueError):
        return False


def address_to_open(access: Access, port: int) -> str:
    """Return the address by which others open the page, without a token."""
    if access.public_url is not None:
        return access.public_url.rstrip("/") + "/"
    return f"http://{bracketed(reachable_name(access.host))}:{port}/"


def address_here(access: Access, port: int) -> str:
    """Return the address by which this computer's own browser opens the page, with the token."""
    near = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(access.host, access.host)  # noqa: S104  (compared, not bound)
    return f"http://{bracketed(near)}:{port}/" + with_token(access.token)


def with_token(token: Token | None) -> str:
    """Return the end of an address that brings a token."""
    return "" if token is None else f"?token={quote(token.text, safe='')}"


def announced(access: Access, port: int) -> str:
    """Return the address as it is printed: a token that the program has made is in it, one that was given is not."""
    token = access.token
    shown = with_token(token) if token is None or token.is_made else "?token=... (the token you gave)"
    return address_to_open(access, port) + shown


def reachable_name(host: str) -> str:
    """Return how other computers call the interface: one that means all of them has no name of its own."""
    if host not in ("0.0.0.0", "::"):  # noqa: S104  (compared, not bound)
        return host
    family = socket.AF_INET6 if host == "::" else socket.AF_INET
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.connect((_SOMEWHERE[family], 9))  # sends nothing
            return str(probe.getsockname()[0])
    except OSError:
        return socket.gethostname()


def bracketed(host: str) -> str:
    """Return a host as an address has it: IPv6 in brackets."""
    return f"[{host.replace('%', '%25')}]" if ":" in host else host
