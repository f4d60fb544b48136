"""Tokens and addresses."""

from __future__ import annotations

import ipaddress
import os
import socket
from pathlib import Path

import pytest

from commission.app.base.access import (
    Access,
    Token,
    address_here,
    address_to_open,
    announced,
    chosen_token,
    is_loopback,
    reachable_name,
)
from commission.errors import ServerError

GIVEN = Token("given: ü & 16 letters")
MADE = Token("made-by-the-program", is_made=True)


def test_a_token_comes_from_the_command_line_a_file_or_the_environment(tmp_path: Path) -> None:
    file = tmp_path / "token"
    file.write_text("from the file \nanother line\n")
    file.chmod(0o600)
    environment = {"COMMISSION_TOKEN": "from the environment"}
    assert chosen_token("typed", None, environment) == Token("typed")
    assert chosen_token(None, file, environment) == Token("from the file")
    assert chosen_token(None, None, environment) == Token("from the environment")
    assert chosen_token(None, None, {}) is None


def test_a_token_that_the_program_makes_is_long_and_new_each_time() -> None:
    made = {chosen_token("auto", None, {}) for _ in range(20)} | {
        chosen_token(None, None, {"COMMISSION_TOKEN": "auto"}) for _ in range(20)
    }
    assert len(made) == 40
    for token in made:
        assert token is not None
        assert token.is_made
        assert len(token.text) >= 32


def test_two_tokens_are_one_too_many(tmp_path: Path) -> None:
    with pytest.raises(ServerError, match="both --token and --token-file"):
        chosen_token("typed", tmp_path / "token", {})


@pytest.mark.parametrize("content", [b"", b"\n", b"  \nsecond", b"\xff\xfe"])
def test_a_file_without_a_token_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "token").write_bytes(content)
    with pytest.raises(ServerError, match="token"):
        chosen_token(None, tmp_path / "token", {})
    with pytest.raises(ServerError, match="no such file"):
        chosen_token(None, tmp_path / "nowhere", {})


@pytest.mark.skipif(os.name != "posix", reason="other systems have no such permissions")
@pytest.mark.parametrize(("mode", "is_told"), [(0o600, False), (0o640, True), (0o604, True)])
def test_a_token_file_that_others_can_read_is_told(
    tmp_path: Path, mode: int, is_told: bool, caplog: pytest.LogCaptureFixture
) -> None:
    file = tmp_path / "token"
    file.write_text("a secret of mine")
    file.chmod(mode)
    assert chosen_token(None, file, {}) == Token("a secret of mine")
    assert bool(caplog.records) is is_told


def test_a_given_token_is_not_printed_and_a_made_one_is() -> None:
    given = Access(token=GIVEN)
    assert announced(given, 8080) == "http://127.0.0.1:8080/?token=... (the token you gave)"
    assert address_here(given, 8080) == "http://127.0.0.1:8080/?token=given%3A%20%C3%BC%20%26%2016%20letters"
    assert announced(Access(token=MADE), 8080) == "http://127.0.0.1:8080/?token=made-by-the-program"
    assert announced(Access(), 8080) == "http://127.0.0.1:8080/"


def test_ipv6_addresses_are_in_brackets() -> None:
    assert announced(Access(host="::1"), 80) == "http://[::1]:80/"
    assert address_here(Access(host="::"), 80) == "http://[::1]:80/"
    assert address_to_open(Access(host="fe80::1%eth0"), 80) == "http://[fe80::1%25eth0]:80/"


def test_the_address_of_all_interfaces_is_one_that_others_can_open() -> None:
    address = address_to_open(Access(host="0.0.0.0", token=MADE), 8080)
    name = address.removeprefix("http://").removesuffix(":8080/")
    assert name != "0.0.0.0"
    try:
        assert not ipaddress.ip_address(name).is_unspecified
    except ValueError:
        assert name == socket.gethostname()
    assert address_here(Access(host="0.0.0.0", token=MADE), 8080).startswith("http://127.0.0.1:8080/")


def test_without_a_network_this_computer_is_called_by_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise OSError("network is unreachable")

    monkeypatch.setattr(socket.socket, "connect", fail)
    for host in ("0.0.0.0", "::"):
        assert reachable_name(host) == socket.gethostname()
    assert reachable_name("10.0.0.7") == "10.0.0.7"


def test_behind_a_proxy_its_address_is_printed() -> None:
    access = Access(public_url="https://agv.example.com", token=MADE)
    assert announced(access, 8080) == "https://agv.example.com/?token=made-by-the-program"
    assert address_here(access, 8080).startswith("http://127.0.0.1:8080/")


@pytest.mark.parametrize(
    ("host", "is_local"),
    [
        ("127.0.0.1", True),
        ("127.9.9.9", True),
        ("localhost", True),
        ("::1", True),
        ("0.0.0.0", False),
        ("::", False),
        ("192.0.2.7", False),
        ("no.such.host.invalid", False),
    ],
)
def test_others_are_let_in_by_any_address_but_this_computers_own(host: str, is_local: bool) -> None:
    assert is_loopback(host) is is_local
    assert Access(host=host).lets_others_in is not is_local
    assert Access(host=host, public_url="https://a").lets_others_in
