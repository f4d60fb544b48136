"""Says to a server whatever no page would say, over all types of messages and all kinds of widgets.

    python -m tests.tools.fuzz_seam --values 100000 --seed 1

Each value is bad by construction, not by asking the code that judges it. An innocent browser looks on: it has to see
each new picture, every refusal has to be told to who was refused, and nothing may stay of all of it.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from random import Random
from typing import Any

import msgspec

from tests.app.base.widget_bench import WidgetBench
from tests.app.raw_client import CAMERA

BATCH = 200
"""Values between two pictures that the innocent browser has to see."""

AHEAD = 2_000
"""Values that may be on their way: the server hears 1,000 a second, and answers to its pings wait behind them."""

NO_NUMBERS: tuple[Any, ...] = ("7", None, [], {}, True, b"7", math.nan, math.inf, -math.inf, [1.0], {"value": 1})
NO_TEXTS: tuple[Any, ...] = (7, 1.5, None, True, [], ["a"], {}, b"text", math.nan)
HUGE: tuple[Any, ...] = (2**63, 2**64 - 1, -(2**63), 1e19, -1e19, 1e300, -1e300)
BEYOND: tuple[Any, ...] = (*HUGE[:1], HUGE[1], 1e19, -1e19, 1e300, 0.5, -1.25)
"""No whole numbers of 64 bits."""

BAD: dict[str, Callable[[Random], Any]] = {
    "button": lambda r: r.choice((False, 1, 0, None, "true", [], math.nan)),
    "group": lambda r: r.choice((*NO_TEXTS, "three", "", "one ", "ONE")),
    "dropdown": lambda r: r.choice((*NO_TEXTS, "c", "", "a\0", "A")),
    "checkbox": lambda r: r.choice((0, 1, None, "true", [], {}, 1.0, math.nan)),
    "count": lambda r: r.choice((*NO_NUMBERS, *BEYOND)),
    "bounded": lambda r: r.choice((*NO_NUMBERS, *BEYOND, r.randint(-1000, 9), r.randint(61, 1000))),
    "height": lambda r: r.choice(NO_NUMBERS),
    "slider": lambda r: r.choice((*NO_NUMBERS, *HUGE, -r.uniform(0.01, 9.0), r.uniform(5.01, 99.0))),
    "multi_slider": lambda r: _bad_tuple(r, 2, 10.01),
    "vector2": lambda r: _bad_tuple(r, 2, 10.01),
    "vector3": lambda r: _bad_tuple(r, 3, math.inf),
    "rgb": lambda r: _bad_tuple(r, 3, 256),
    "rgba": lambda r: _bad_tuple(r, 4, 256),
    "text": lambda r: r.choice((*NO_TEXTS, "x" * r.randint(1_001, 5_000), "a\0b", "line\nline", "\x1b[2J", "\x7f")),
    "lines": lambda r: r.choice((*NO_TEXTS, "a\0b", "\x1b[2J", "\x08")),
    "progress": lambda r: r.choice((0.0, 50.0, 100, "x", None)),
    "disabled": lambda r: r.choice((True, False, 1, "x")),
}
"""A value that a person cannot give to the widget of that name; see `WidgetBench.widgets`."""


def _bad_tuple(random: Random, length: int, beyond: float) -> Any:
    """Numbers of which one is none or too large, or too many or few of them, or something else."""
    values: list[Any] = [1] * length
    match random.randrange(4):
        case 0:
            values[random.randrange(length)] = random.choice(NO_NUMBERS)
        case 1:
            values[random.randrange(length)] = beyond
        case 2:
            return [1] * random.choice([n for n in range(7) if n != length])
        case _:
            return random.choice((None, 5, "123"[:length], {}, True, 1.5, b"abc"))
    return values


POINT, QUATERNION, SCREEN = [0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0], [0.5, 0.5]
RAY = {"ray_origin": POINT, "ray_direction": [0.0, 0.0, -1.0]}
NODE = {"name": "/box", "instance_index": None, "modifier": None, "owner": ""}


def good_messages(bench: WidgetBench) -> dict[str, dict[str, Any]]:
    """One message of each type as a page sends it; none of them changes what a widget holds."""
    name = {widget: bench.widgets[widget]._impl.uuid for widget in bench.widgets}
    upload = {"source_component_uuid": bench.upload._impl.uuid, "transfer_uuid": "t"}
    return {
        "ViewerCameraMessage": dict(CAMERA),
        "GuiUpdateMessage": {"uuid": name["count"], "updates": {"value": 7}},
        "GuiButtonHoldMessage": {"uuid": name["button"], "frequency": 10.0},
        "GuiFormSubmitMessage": {"uuid": bench.form._impl.uuid},
        "GuiFormDirtyMessage": {"uuid": bench.form._impl.uuid},
        "CommandTriggerMessage": {"uuid": bench.command._impl.uuid},
        "FileTransferStartUpload": {**upload, "filename": "f", "mime_type": "", "part_count": 1, "size_bytes": 1},
        "FileTransferPart": {**upload, "part_index": 0, "content": b"x"},
        "TransformControlsUpdateMessage": {"name": "/gizmo", "wxyz": QUATERNION, "position": POINT, "owner": ""},
        "TransformControlsDragStartMessage": {"name": "/gizmo", "owner": ""},
        "TransformControlsDragEndMessage": {"name": "/gizmo", "owner": ""},
        "ScenePointerMessage": {"event_type": "click", **RAY, "screen_pos": [SCREEN], "modifier": None},
        "SceneNodeClickMessage": {**NODE, **RAY, "screen_pos": SCREEN},
        "SceneNodeDragMessage": {
            **NODE,
            "phase": "start",
            "start_position": POINT,
            "start_screen_pos": SCREEN,
            "end_position": POINT,
            "end_screen_pos": SCREEN,
            "button": "left",
        },
    }


MAY_BE_NONE = {"instance_index", "modifier", "ray_origin", "ray_direction"}
FOREIGN_TYPES = (
    "RunJavascriptMessage", "SetGuiPanelLabelMessage", "GuiRemoveMessage", "RemoveSceneNodeMessage", "ShareUrlRequest",
    "ShareUrlDisconnect", "GetRenderResponseMessage", "LocalStorageSetItemMessage", "FileTransferPartAck", "Message",
    "NotificationShowMessage", "ResetGuiMessage", "SceneNodeUpdateMessage", "GuiCloseModalMessage", "", "__class__",
)  # fmt: skip


def bad_message(bench: WidgetBench, random: Random) -> bytes | str:
    """Something that no page says."""
    good = good_messages(bench)
    match random.randrange(10):
        case 0 | 1 | 2 | 3 | 4:
            widget = random.choice(tuple(BAD))
            uuid = bench.widgets[widget]._impl.uuid
            return _packed("GuiUpdateMessage", uuid=uuid, updates={"value": BAD[widget](random)})
        case 5:
            widget = bench.widgets[random.choice(tuple(bench.widgets))]
            attribute = random.choice(("props", "label", "visible", "disabled", "min", "_impl", "uuid", "content", ""))
            updates = random.choice(({attribute: 5}, {"value": 7, attribute: 5}, {}, {attribute: [1] * 100}))
            return _packed("GuiUpdateMessage", uuid=widget._impl.uuid, updates=updates)
        case 6 | 7:
            kind = random.choice(tuple(good))
            return _packed(kind, **_spoiled(good[kind], random))
        case 8:
            kind, fields = random.choice(FOREIGN_TYPES), good[random.choice(tuple(good))]
            return _packed(kind, **fields)
        case _:
            return _noise(good, random)


def _packed(kind: str, **fields: Any) -> bytes:
    return msgspec.msgpack.encode({"type": kind, **fields})


def _spoiled(fields: dict[str, Any], random: Random) -> dict[str, Any]:
    """Return a message with one field that is missing, too much, or of another kind."""
    name = random.choice(tuple(fields))
    value = fields[name]
    match random.randrange(4):
        case 0 if name != "owner":
            return {other: fields[other] for other in fields if other != name}
        case 1:
            return {**fields, random.choice(("token", "excluded_self_client", "value", "")): 1}
    if isinstance(value, list) and value and not isinstance(value[0], list):
        changed = list(value)
        changed[random.randrange(len(value))] = random.choice((math.nan, math.inf, 1e300, "1", None, [], 2e9))
        return {**fields, name: random.choice((changed, value[:-1], [*value, 0.0], "text", 5))}
    junk: tuple[Any, ...] = ([1, 2, 3, 4, 5, 6, 7], {"a": 1}, math.nan, 1e300)
    if isinstance(value, str):
        junk = (*junk, "nobody", "x" * 2_000) if name not in ("filename", "mime_type", "transfer_uuid") else junk
        junk = (*junk, 5, True)
    elif name not in MAY_BE_NONE:
        junk = (*junk, None, "text")
    return {**fields, name: random.choice(junk)}


def _noise(good: dict[str, dict[str, Any]], random: Random) -> bytes | str:
    """Return bytes that are no message: random ones, cut off ones, deep ones, text."""
    kind = random.choice(tuple(good))
    whole = _packed(kind, **good[kind])
    match random.randrange(4):
        case 0:
            return b"\xc1" + random.randbytes(random.randrange(60))
        case 1:
            return whole[: random.randrange(1, len(whole))]
        case 2:
            return b"\x91" * random.randrange(1, 5_000)
        case _:
            return "text " * random.randrange(1, 50)


@dataclass(frozen=True, slots=True)
class Fuzzed:
    """What came of it."""

    sent: int
    """Bad values."""
    told: int
    """Refusals of which the browser that sent them was told."""
    pictures: int
    """Pictures that the innocent browser saw meanwhile."""
    seconds: float
    """How long it took [s]."""
    slowest_picture: float
    """Longest time until the innocent browser saw a picture [s]."""


def fuzz(bench: WidgetBench, count: int, seed: int) -> Fuzzed:
    """Send bad values; raises AssertionError where one of them has changed something or disturbs somebody."""
    random, started = Random(seed), time.monotonic()
    values, kept, slowest = bench.values, bench.kept, 0.0
    bench.guest.heard.clear()
    for begun in range(0, count, BATCH):
        for _ in range(min(BATCH, count - begun)):
            bench.guest.send_raw(bad_message(bench, random))
        drawing = time.monotonic()
        bench.draw()
        slowest = max(slowest, time.monotonic() - drawing)
        bench.innocent.heard.clear()
        bench.guest.hear_all(0.001)
        while bench.guest.refused < begun - AHEAD:
            bench.guest.hear(30.0)
    _hear_the_rest(bench, count)
    assert bench.values == values, "a widget holds something else"
    assert bench.changed == [], "a callback has heard of it"
    assert bench.kept == kept, "something stays for browsers that come"
    assert bench.server.transfers.open == ()
    return Fuzzed(count, bench.guest.refused, -(-count // BATCH), time.monotonic() - started, slowest)


def _hear_the_rest(bench: WidgetBench, count: int) -> None:
    """Hear of refusals until all have been told, or nothing has come for some seconds."""
    before = -1
    while before < bench.guest.refused < count:
        before = bench.guest.refused
        bench.guest.hear_all(4.0)


def main() -> None:
    """Fuzz from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--values", type=int, default=100_000, help="bad values")
    parser.add_argument("--seed", type=int, default=1, help="of the random numbers")
    asked = parser.parse_args()
    bench = WidgetBench()
    try:
        found = fuzz(bench, asked.values, asked.seed)
    finally:
        bench.close()
    sys.stdout.write(
        f"{found.sent} bad values in {found.seconds:.0f} s; told {found.told}; "
        f"{found.pictures} pictures seen, the slowest after {found.slowest_picture:.2f} s; nothing persists\n"
    )
    raise SystemExit(0 if found.told == found.sent else 1)


if __name__ == "__main__":
    main()
