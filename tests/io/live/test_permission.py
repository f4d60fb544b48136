"""Which sources a browser may name: both sides of each limit, and how a refusal says to allow it."""

from __future__ import annotations

import pytest

from commission.errors import UsageError
from commission.io.live.permission import MOST_SOURCES, Permission

ALONE = Permission()
SHARED = Permission(is_shared=True)


@pytest.mark.parametrize(
    "text",
    [
        "cola:10.0.0.7:2112",
        "cola:172.16.0.1:2112",
        "cola:172.31.255.255:65535",
        "cola:192.168.255.1:1024",
        "cola@front:fd00::7:2112",
        "json:127.0.0.1:0",
        "json:127.0.0.1:1024",
        "sick-safety:192.168.0.5:6060",
    ],
)
def test_devices_in_private_networks_may_be_named(text: str) -> None:
    for permission in (ALONE, SHARED):
        assert [str(each) for each in permission.checked([text])] == [text]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("cola:9.255.255.255:2112", "no private network"),
        ("cola:11.0.0.0:2112", "no private network"),
        ("cola:172.15.255.255:2112", "no private network"),
        ("cola:172.32.0.0:2112", "no private network"),
        ("cola:169.254.169.254:2112", "no private network"),
        ("cola:0.0.0.0:2112", "stands for this computer"),
        ("json:0.0.0.0:6061", "no private network"),
        ("cola:::ffff:8.8.8.8:2112", "no private network"),
        ("cola:10.0.0.7:1023", "system's services"),
        ("cola:10.0.0.7:0", "system's services"),
        ("json:127.0.0.1:1023", "system's services"),
        ("cola:robot.example.com:2112", "a name"),
        ("cola:127.1:2112", "a name"),
        ("cola:010.0.0.7:2112", "a name"),
    ],
)
def test_nothing_else_may_be_named_and_the_refusal_says_how_to_allow_it(text: str, why: str) -> None:
    for permission in (ALONE, SHARED):
        with pytest.raises(UsageError, match=why) as refused:
            permission.checked([text])
        assert f"started with --source {text!r}" in str(refused.value)
        # What the refusal says is so.
        assert Permission.of([text], [], is_shared=True).checked([text])


def test_services_of_this_computer_are_not_for_other_computers_to_try() -> None:
    for host in ("127.0.0.1", "127.8.0.1", "::1"):
        assert ALONE.checked([f"cola:{host}:2112"])
        with pytest.raises(UsageError, match="not for others to try"):
            SHARED.checked([f"cola:{host}:2112"])
    # Nothing is connected to where datagrams are listened to.
    assert SHARED.checked(["json:127.0.0.1:6061"])


@pytest.mark.parametrize(
    "host", ["fd00::1%x]@127.0.0.1:38915?q=", "fd00::1%eth0", "fd00::1%]#", "::%1", "::ffff:10.0.0.1%?"]
)
@pytest.mark.parametrize("kind", ["rosbridge", "cola"])
def test_nothing_hides_behind_the_number_of_an_address(kind: str, host: str) -> None:
    for permission in (ALONE, SHARED):
        with pytest.raises(UsageError):
            permission.checked([f"{kind}:{host}:9090"])


def test_other_names_of_this_computer_are_not_for_others_to_try_whatever_networks_are_let_in() -> None:
    permission = Permission.of([], ["0.0.0.0/0", "::/0"], is_shared=True)
    for host in ("0.0.0.0", "::", "::ffff:127.0.0.1", "::ffff:0.0.0.0", "127.0.0.1", "::1"):
        with pytest.raises(UsageError, match="not for a browser to name"):
            permission.checked([f"cola:{host}:2112"])
    with pytest.raises(UsageError) as refused:
        SHARED.checked(["json:0.0.0.0:6061"])
    assert "--connect-to" not in str(refused.value)


def test_localhost_is_the_address_that_it_stands_for() -> None:
    assert str(ALONE.checked(["cola:localhost:2112"])[0]) == "cola:127.0.0.1:2112"


def test_what_was_named_at_the_start_is_that_address_alone_for_any_scanner() -> None:
    permission = Permission.of(["cola:8.8.8.8:80"], [], is_shared=True)
    assert permission.checked(["cola:8.8.8.8:80", "cola@rear:8.8.8.8:80"])
    for text in ("cola:8.8.8.8:81", "cola:8.8.8.9:80", "json:8.8.8.8:80"):
        with pytest.raises(UsageError, match="not for a browser to name"):
            permission.checked([text])


def test_networks_that_were_named_at_the_start_are_let_in() -> None:
    permission = Permission.of([], ["169.254.0.0/16", "203.0.113.9"], is_shared=False)
    assert permission.checked(["cola:169.254.3.4:2112", "cola:203.0.113.9:2112", "cola:10.0.0.1:2112"])
    for text in ("cola:203.0.113.10:2112", "cola:169.254.3.4:22"):
        with pytest.raises(UsageError):
            permission.checked([text])
    with pytest.raises(UsageError, match="ADDRESS/BITS"):
        Permission.of([], ["10.0.0.1/33"], is_shared=False)
    # Of an address with bits behind those of its network, the network is meant.
    assert Permission.of([], ["203.0.113.9/24"], is_shared=False).checked(["cola:203.0.113.10:2112"])


def test_so_many_sources_may_be_named_at_once() -> None:
    assert len(ALONE.checked(["json:127.0.0.1:0"] * MOST_SOURCES)) == MOST_SOURCES
    with pytest.raises(UsageError, match="16 at most"):
        ALONE.checked(["json:127.0.0.1:0"] * (MOST_SOURCES + 1))
