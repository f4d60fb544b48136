"""The seam to viser, spoken to by raw clients: what a browser says is checked before viser hears it."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest

from commission.app.base import connection, seam, viser_private
from tests.app.base.widget_bench import WidgetBench
from tests.app.raw_client import CAMERA, RawClient


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(seam, "TOLD_EVERY_S", 0.05)


@pytest.fixture
def bench() -> Iterator[WidgetBench]:
    opened = WidgetBench()
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def one_bench() -> Iterator[WidgetBench]:
    opened = WidgetBench()
    yield opened
    opened.close()


@pytest.fixture
def shared(one_bench: WidgetBench) -> WidgetBench:
    """A bench that other tests have used, for tests that change nothing of it; its guest is new."""
    one_bench.begin_anew()
    return one_bench


BAD_VALUES: tuple[tuple[str, object, str], ...] = (
    ("count", 1e20, "Seed: found 1e+20; expected a whole number of at most 64 bits"),
    ("count", 2**63, "Seed: found 9223372036854775808; expected a whole number of at most 64 bits"),
    ("count", 1.5, "Seed: found 1.5; expected a whole number of at most 64 bits"),
    ("count", "9", "Seed: found '9'; expected a number"),
    ("height", math.nan, "GuiUpdateMessage: found nan; expected finite numbers"),
    ("height", -math.inf, "GuiUpdateMessage: found -inf; expected finite numbers"),
    ("height", None, "Height: found None; expected a number"),
    ("bounded", 61, "Count: found 61; expected 10 to 60"),
    ("slider", 5.1, "Speed: found 5.1; expected 0 to 5"),
    ("multi_slider", [1.0, 11.0], "Ends: found 11; expected 0 to 10"),
    ("multi_slider", [1.0, 2.0, 3.0], "Ends: found [1.0, 2.0, 3.0]; expected 2 numbers"),
    ("vector2", [1.0, -0.1], "Place: found -0.1; expected 0 to 10"),
    ("vector3", [1.0, 2.0], "Point: found [1.0, 2.0]; expected 3 numbers"),
    ("rgb", [0, 0, 256], "Color: found 256; expected 0 to 255"),
    ("rgba", [0, 0, 0, 0.5], "Veil: found 0.5; expected a whole number of at most 64 bits"),
    ("checkbox", 1, "Switch: found 1; expected true or false"),
    ("button", False, "Press: found False; expected true"),
    ("group", "three", "Group: found 'three'; expected one of the choices shown"),
    ("dropdown", ["a"], "Choice: found ['a']; expected one of the choices shown"),
    ("text", "x" * 1_001, "Name: found more than 1,000 letters; expected at most as many"),
    ("text", "a\0b", "Name: found the control character '\\x00'; expected text"),
    ("text", 5, "Name: found 5; expected text"),
    ("lines", "x" * 1_000_001, "Table: found more than 1,000,000 letters; expected at most as many"),
    ("progress", 50.0, "a field: found 50; expected nothing: it cannot be changed"),
    ("disabled", True, "Not now cannot be used at the moment; nothing was done"),
)


@pytest.mark.parametrize(("name", "value", "told"), BAD_VALUES)
def test_a_value_that_no_person_can_give_changes_nothing_and_is_told_to_that_browser_alone(
    shared: WidgetBench, name: str, value: object, told: str
) -> None:
    values, kept = shared.values, shared.kept
    shared.guest.update(shared.widgets[name], value)
    shared.guest.hear_until(lambda message: message["type"] == "NotificationShowMessage")
    assert shared.guest.refusals == [told]
    shared.draw()
    assert shared.values == values
    assert shared.kept == kept
    assert shared.changed == []
    assert shared.innocent.refusals == []


GOOD_VALUES: tuple[tuple[str, object, object], ...] = (
    ("count", 2**63 - 1, 2**63 - 1),
    ("count", -(2**63), -(2**63)),
    ("count", 12.0, 12),
    ("height", 3, 3.0),
    ("bounded", 10, 10),
    ("bounded", 60, 60),
    ("slider", 5.0 * (1 + 1e-12), 5.0 * (1 + 1e-12)),
    ("multi_slider", [0, 10.0], (0.0, 10.0)),
    ("vector2", [0.0, 10], (0.0, 10.0)),
    ("vector3", [-1e6, 0, 7.5], (-1e6, 0.0, 7.5)),
    ("rgb", [0, 255, 9], (0, 255, 9)),
    ("rgba", [0, 255, 9, 255], (0, 255, 9, 255)),
    ("checkbox", True, True),
    ("group", "two", "two"),
    ("dropdown", "b", "b"),
    ("text", "x" * 1_000, "x" * 1_000),
    ("lines", "x;y\r\n1;2\t\n", "x;y\r\n1;2\t\n"),
)


@pytest.mark.parametrize(("name", "value", "expected"), GOOD_VALUES)
def test_a_value_at_its_bound_is_taken_and_reaches_the_other_browser(
    bench: WidgetBench, name: str, value: object, expected: object
) -> None:
    bench.guest.update(bench.widgets[name], value)
    bench.until(lambda: bench.changed == [(name, expected)])
    if name != "group":  # buttons are pressed, not set
        bench.innocent.hear_until(lambda message: "value" in message.get("updates", {}))
    assert bench.guest.refusals == []


def test_a_pressed_button_is_heard(bench: WidgetBench) -> None:
    pressed: list[int] = []
    bench.widgets["button"].on_click(lambda event: pressed.append(event.client_id))
    bench.guest.update(bench.widgets["button"], True)
    bench.until(lambda: pressed == [0])


@pytest.mark.parametrize("name", ["label", "disabled", "props", "min", "_impl", "uuid", "content"])
def test_no_browser_can_change_anything_of_a_widget_but_its_value(shared: WidgetBench, name: str) -> None:
    kept = shared.kept
    for widget in shared.widgets.values():
        shared.guest.update(widget, 5, name)
    shared.guest.update(shared.clock, "mine", "content")
    shared.draw()
    shared.guest.hear_all(0.5)
    assert shared.guest.refused == len(shared.widgets) + 1
    assert shared.kept == kept
    assert all(widget.visible for widget in shared.widgets.values())


def update_of(uuid: str, **updates: object) -> dict[str, Any]:
    return {"type": "GuiUpdateMessage", "uuid": uuid, "updates": updates}


NODE = {
    "name": "/nowhere",
    "instance_index": None,
    "ray_origin": [0.0, 0.0, 1.0],
    "ray_direction": [0.0, 0.0, -1.0],
    "screen_pos": [0.5, 0.5],
    "modifier": None,
}
DRAG = {
    "phase": "start",
    "name": "/box",
    "instance_index": None,
    "start_position": [0.0, 0.0, 0.0],
    "start_screen_pos": [0.5, 0.5],
    "end_position": [0.0, 0.0, 0.0],
    "end_screen_pos": [0.5, 0.5],
    "button": "left",
    "modifier": None,
}
CLICK = {**NODE, "event_type": "click", "screen_pos": [[0.5, 0.5]]}
del CLICK["name"], CLICK["instance_index"]

BAD_MESSAGES: dict[str, dict[str, Any]] = {
    "no type": {"uuid": "root"},
    "an unknown type": {"type": "Nonsense"},
    "what only servers say": {"type": "RunJavascriptMessage", "source": "alert(1)"},
    "a theme": {"type": "SetGuiPanelLabelMessage", "label": "mine"},
    "a tunnel": {"type": "ShareUrlRequest"},
    "no tunnel": {"type": "ShareUrlDisconnect"},
    "a picture that nobody asked for": {"type": "GetRenderResponseMessage", "payload": b"", "render_uuid": "x"},
    "an unknown widget": update_of("nobody", value=1),
    "no value": update_of("nobody"),
    "an unknown form": {"type": "GuiFormDirtyMessage", "uuid": "random"},
    "an unknown form sent": {"type": "GuiFormSubmitMessage", "uuid": "random"},
    "an unknown command": {"type": "CommandTriggerMessage", "uuid": "random"},
    "an unknown button": {"type": "GuiButtonHoldMessage", "uuid": "random", "frequency": 10.0},
    "an unknown upload": {
        "type": "FileTransferStartUpload",
        "source_component_uuid": "random",
        "transfer_uuid": "t",
        "filename": "f",
        "mime_type": "",
        "part_count": 1,
        "size_bytes": 1,
    },
    "a part for nobody": {
        "type": "FileTransferPart",
        "source_component_uuid": None,
        "transfer_uuid": "t",
        "part_index": 0,
        "content": b"x",
    },
    "an unknown gizmo": {"type": "TransformControlsDragStartMessage", "name": "/box", "owner": ""},
    "a foreign gizmo": {"type": "TransformControlsDragEndMessage", "name": "/gizmo", "owner": "somebody"},
    "a gizmo turned into nothing": {
        "type": "TransformControlsUpdateMessage",
        "name": "/gizmo",
        "wxyz": [0.0, 0.0, 0.0, 0.0],
        "position": [0.0, 0.0, 0.0],
        "owner": "",
    },
    "a gizmo beyond everything": {
        "type": "TransformControlsUpdateMessage",
        "name": "/gizmo",
        "wxyz": [1.0, 0.0, 0.0, 0.0],
        "position": [0.0, 2e9, 0.0],
        "owner": "",
    },
    "a click on nothing": {"type": "SceneNodeClickMessage", **NODE},
    "a drag of nothing": {"type": "SceneNodeDragMessage", **DRAG, "name": "/nowhere"},
    "a drag with the fourth button": {"type": "SceneNodeDragMessage", **DRAG, "button": "fourth"},
    "a click without a ray": {"type": "ScenePointerMessage", **CLICK, "ray_origin": None},
    "a rectangle with one corner": {"type": "ScenePointerMessage", **CLICK, "event_type": "rect-select"},
    "a camera that looks at itself": {"type": "ViewerCameraMessage", **CAMERA, "look_at": CAMERA["position"]},
    "a camera without up": {"type": "ViewerCameraMessage", **CAMERA, "up_direction": [0.0, 0.0, 0.0]},
    "a camera of no size": {"type": "ViewerCameraMessage", **CAMERA, "image_height": 0},
    "a camera that looks nowhere": {"type": "ViewerCameraMessage", **CAMERA, "look_at": [math.nan, 0.0, 0.0]},
    "a camera with too few numbers": {"type": "ViewerCameraMessage", **CAMERA, "wxyz": [1.0, 0.0]},
    "a camera with something more": {"type": "ViewerCameraMessage", **CAMERA, "token": "x"},
}


@pytest.mark.parametrize("name", BAD_MESSAGES)
def test_a_message_that_no_page_sends_is_told_and_leaves_no_trace(
    shared: WidgetBench, name: str, caplog: pytest.LogCaptureFixture
) -> None:
    kept = shared.kept
    shared.guest.send(**BAD_MESSAGES[name])
    shared.guest.hear_until(lambda message: message["type"] == "NotificationShowMessage")
    assert shared.guest.refused == 1
    shared.draw()
    assert shared.kept == kept
    assert shared.innocent.refusals == []
    assert [record for record in caplog.records if record.levelno >= logging.WARNING] == []


@pytest.mark.parametrize(
    "raw",
    [b"", b"\xc1", b"\xdd\xff\xff\xff\xff", b"\x91" * 100_000, b"\x81\xa4type\xa1\xff", b"\xc0", b"\x2a", "text", ""],
)
def test_bytes_that_are_no_message_are_told_and_the_connection_lives_on(bench: WidgetBench, raw: bytes | str) -> None:
    bench.guest.send_raw(raw)
    bench.guest.hear_until(lambda message: message["type"] == "NotificationShowMessage")
    bench.guest.update(bench.widgets["count"], 8)
    bench.until(lambda: bench.changed == [("count", 8)])


def test_the_second_of_two_equal_keys_is_what_is_checked_and_what_viser_hears(bench: WidgetBench) -> None:
    """Two readers of the same bytes could take different ones."""
    uuid = bench.widgets["count"]._impl.uuid.encode()

    def text(content: bytes) -> bytes:
        return b"\xd9" + bytes([len(content)]) + content

    head = b"\x84" + text(b"type") + text(b"GuiUpdateMessage") + text(b"uuid") + text(uuid)
    good, bad = b"\x81" + text(b"value") + b"\x09", b"\x81" + text(b"props") + b"\x05"
    bench.guest.send_raw(head + text(b"updates") + good + text(b"updates") + bad)
    bench.guest.hear_until(lambda message: message["type"] == "NotificationShowMessage")
    bench.guest.send_raw(head + text(b"updates") + bad + text(b"updates") + good)
    bench.until(lambda: bench.changed == [("count", 9)])
    assert "props" not in str(bench.kept)


def test_what_a_page_says_of_gizmos_nodes_forms_and_commands_is_heard(bench: WidgetBench) -> None:
    heard: list[str] = []
    bench.command.on_trigger(lambda _event: heard.append("command"))
    bench.form.on_submit(lambda _event: heard.append("form"))
    bench.box.on_click(lambda _event: heard.append("box"))
    bench.box.on_drag("left")(lambda event: heard.append(event.phase))
    bench.gizmo.on_update(lambda _event: heard.append("gizmo"))
    bench.server.scene.on_click()(lambda _event: heard.append("floor"))
    bench.server.scene.on_rect_select()(lambda _event: heard.append("rectangle"))
    bench.widgets["button"].on_hold(callback_hz=10.0)(lambda _event: heard.append("hold"))
    say = bench.guest.send
    say(type="CommandTriggerMessage", uuid=bench.command._impl.uuid)
    say(type="GuiFormDirtyMessage", uuid=bench.form._impl.uuid)
    say(type="GuiFormSubmitMessage", uuid=bench.form._impl.uuid)
    say(type="SceneNodeClickMessage", **{**NODE, "name": "/box", "owner": ""})
    say(type="SceneNodeDragMessage", **DRAG, owner="")
    say(type="SceneNodeDragMessage", **{**DRAG, "phase": "end"}, owner="")
    say(type="TransformControlsDragStartMessage", name="/gizmo", owner="")
    say(type="TransformControlsUpdateMessage", name="/gizmo", wxyz=[1, 0, 0, 0], position=[1, 2, 3], owner="")
    say(type="TransformControlsDragEndMessage", name="/gizmo", owner="")
    say(type="ScenePointerMessage", **CLICK)
    say(type="ScenePointerMessage", **{**CLICK, "event_type": "rect-select", "screen_pos": [[0, 0], [1, 1]]})
    say(type="GuiButtonHoldMessage", uuid=bench.widgets["button"]._impl.uuid, frequency=10)
    expected = ["command", "form", "box", "start", "end", "gizmo", "gizmo", "gizmo", "floor", "rectangle", "hold"]
    bench.until(lambda: len(heard) == len(expected))
    assert heard == expected
    assert tuple(bench.gizmo.position) == (1.0, 2.0, 3.0)
    assert bench.guest.refusals == []


def test_a_connection_that_has_not_become_a_browser_changes_nothing(bench: WidgetBench) -> None:
    stranger = RawClient(bench.server, is_silent=True)
    stranger.update(bench.widgets["count"], 8)
    stranger.hear_until(lambda message: message["type"] == "NotificationShowMessage")
    assert stranger.refusals == ["GuiUpdateMessage came before the page was ready; nothing was done"]
    assert bench.widgets["count"].value == 7
    stranger.close()


def test_a_refused_value_is_shown_no_longer_than_a_moment_in_the_field_where_it_was_typed(bench: WidgetBench) -> None:
    bench.guest.update(bench.widgets["count"], 1e20)
    back = bench.guest.hear_until(lambda message: message["type"] == "GuiUpdateMessage")
    assert back["updates"] == {"value": 7}
    assert back["uuid"] == bench.widgets["count"]._impl.uuid
    bench.draw()
    assert [message for message in bench.innocent.heard if message.get("updates") == {"value": 7}] == []


def test_a_number_beyond_its_bounds_is_told_and_said_at_the_field(bench: WidgetBench) -> None:
    bench.guest.update(bench.widgets["bounded"], 61)
    said = bench.guest.hear_until(
        lambda message: message["type"] == "RunJavascriptMessage" and "commissionRefuse" in message["source"]
    )
    assert bench.widgets["bounded"]._impl.uuid in said["source"]
    assert "Count: found 61; expected 10 to 60" in said["source"]
    bench.guest.hear_all(0.3)
    assert bench.guest.refusals == ["Count: found 61; expected 10 to 60"]
    assert bench.widgets["bounded"].value == 20
    assert [message for message in bench.innocent.heard if "commissionRefuse" in message.get("source", "")] == []


def test_a_flood_of_refusals_is_a_few_notes_that_count_them_all(bench: WidgetBench) -> None:
    for _ in range(300):
        bench.guest.update(bench.widgets["checkbox"], "yes")
    bench.guest.hear_all(1.0)
    assert bench.guest.refused == 300
    assert len(bench.guest.refusals) < 30


def test_a_message_that_is_too_large_ends_only_its_own_connection(bench: WidgetBench) -> None:
    bench.guest.send_raw(b"x" * (connection.LARGEST_MESSAGE + 1))
    bench.guest.hear_all(2.0)
    assert "4194304" in bench.guest.close_reason or "limit" in bench.guest.close_reason
    bench.draw()


def test_forms_with_invented_names_fill_no_memory(bench: WidgetBench) -> None:
    kept = bench.kept
    for number in range(500):
        bench.guest.send(type="GuiFormDirtyMessage", uuid=f"form{number}")
    bench.guest.hear_all(1.0)
    assert bench.guest.refused == 500
    assert bench.kept == kept


@pytest.mark.measures_time
def test_a_flood_of_messages_waits_and_the_others_are_heard(
    bench: WidgetBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connection, "MESSAGES_PER_S", 100.0)
    for number in range(1_500):
        bench.guest.update(bench.widgets["count"], number)
    started = time.monotonic()
    bench.innocent.update(bench.widgets["checkbox"], True)
    bench.until(lambda: ("checkbox", True) in bench.changed)
    assert time.monotonic() - started < 2.0
    assert bench.widgets["count"].value < 1_400


def test_callbacks_run_in_the_order_in_which_a_person_did_things(bench: WidgetBench) -> None:
    for number in range(200):
        bench.guest.update(bench.widgets["count"], 1_000 + number)
    bench.until(lambda: len(bench.changed) >= 200)
    assert [value for _, value in bench.changed] == [1_000 + number for number in range(200)]


def test_what_a_person_did_is_not_lost_where_the_page_writes_what_held_before(bench: WidgetBench) -> None:
    heard: list[tuple[object, str]] = []
    go_on = threading.Event()
    bench.widgets["text"].on_update(lambda _event: go_on.wait(10.0) and None)
    switch = bench.widgets["checkbox"]
    switch.on_update(lambda event: event.client is not None and heard.append((event.target.value, event.target.label)))
    before = switch.value
    # The thread of the callbacks is busy, and the owner thread draws a picture that knows nothing of the click.
    bench.guest.update(bench.widgets["text"], "busy")
    bench.guest.update(switch, not before)
    bench.until(lambda: switch.value is not before)
    switch.value = before
    go_on.set()
    bench.until(lambda: bool(heard))
    assert heard == [(not before, "Switch")]


@pytest.mark.parametrize(
    ("name", "entered"),
    [("slider", 3), ("count", 41), ("text", "depot"), ("vector2", [4, 5]), ("dropdown", "b"), ("checkbox", True)],
)
def test_nor_where_it_writes_while_the_others_are_told_of_it(bench: WidgetBench, name: str, entered: Any) -> None:
    """Between viser's own note of a value and its callbacks lies the message to every other browser."""
    widget = bench.widgets[name]
    before, heard, tell_others = widget.value, [], widget._impl.sync_cb

    def tell_others_while_the_owner_thread_draws(*told: Any) -> None:
        tell_others(*told)
        widget.value = before

    widget._impl.sync_cb = tell_others_while_the_owner_thread_draws
    widget.on_update(lambda event: event.client is not None and heard.append(event.target.value))
    bench.guest.update(widget, entered)
    bench.until(lambda: bool(heard))
    expected = tuple(map(float, entered)) if isinstance(entered, list) else type(before)(entered)
    assert heard == [expected]
    assert isinstance(heard[0], type(before))


def test_a_callback_that_fails_is_one_line_in_the_log_and_the_next_one_runs(
    bench: WidgetBench, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    def fail(_event: object) -> None:
        raise RuntimeError("a mistake of ours")

    async def fail_later(_event: object) -> None:
        raise RuntimeError("another one")

    bench.widgets["button"].on_click(fail)
    bench.box.on_click(fail_later)
    bench.guest.update(bench.widgets["button"], True)
    bench.guest.send(type="SceneNodeClickMessage", **{**NODE, "name": "/box"})
    bench.until(lambda: len(caplog.records) == 2)
    assert {str(record.exc_info[1]) for record in caplog.records if record.exc_info} == {
        "a mistake of ours",
        "another one",
    }
    bench.guest.update(bench.widgets["count"], 8)
    bench.until(lambda: ("count", 8) in bench.changed)
    assert capfd.readouterr().err == ""


def test_writing_to_a_browser_that_has_gone_throws_nothing(bench: WidgetBench) -> None:
    gone = bench.server.get_clients()[0]
    bench.guest.close()
    bench.until(lambda: 0 not in bench.server.get_clients())
    gone.add_notification("Note", "nobody reads it")
    gone.gui.add_html("nor this")
    gone.camera.position = (0.0, 0.0, 1.0)
    viser_private.notify(bench.server, 0, title="t", text="nor that", seconds=1.0)
    bench.draw()
