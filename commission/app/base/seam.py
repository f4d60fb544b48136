"""The seam to viser: every message of a browser is checked here before viser's own handlers see it.

viser takes values as they come, keeps them and sends them to all others. What is refused here changes nothing, is told
to the browser that said it, and its field shows again what holds. All of it runs on the server's event loop.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import singledispatchmethod
from typing import Any

from viser import GuiApi, GuiButtonHandle, GuiUploadButtonHandle, SceneApi, ViserServer

from commission.app.base import viser_private, wire
from commission.app.base.widget_values import problem_with
from commission.app.base.wire import AnyMessage, FromBrowser, Refusal

log = logging.getLogger(__name__)

TOLD_EVERY_S = 0.5
"""Shortest time between two notes to one browser [s]: a flood of refusals is one note with their number."""
TOLD_FOR_S = 8.0
NEAREST_LOOK_M = 1e-9
"""Distance at which a camera looks at nothing any more [m]; to turn it would divide by that."""
GONE = "what was pressed or changed is no longer on the page; nothing was done"


@dataclass(slots=True)
class _Note:
    """What a browser is to be told next."""

    text: str
    more: int = 0
    """How many other refusals there were meanwhile."""


class Seam:
    """Checks what browsers say to one server."""

    def __init__(self, server: ViserServer) -> None:
        self._server = server
        self._loop = viser_private.event_loop(server)
        self._notes: dict[int, _Note] = {}

    def admit(self, number: int, raw: bytes | str) -> bytes | None:
        """Return a message as viser may read it, or None after its refusal has been told.

        Parameters
        ----------
        number : of the browser's connection.
        raw : as it came.
        """
        message = wire.parsed(raw)
        if isinstance(message, Refusal):
            return self._refuse(number, message)
        refusal = self.refusal(number, message)
        if refusal is not None:
            return self._refuse(number, refusal)
        if isinstance(message, wire.GuiUpdateMessage):
            viser_private.carry_out(message.uuid, message.updates["value"])
        return wire.encoded(message)

    def refusal(self, number: int, message: AnyMessage) -> Refusal | None:
        """Say why a message that is well-formed cannot come from a person at this browser; None when it can."""
        is_camera = isinstance(message, wire.ViewerCameraMessage)
        if not is_camera and viser_private.client_of(self._server, number) is None:
            return Refusal(f"{type(message).__name__} came before the page was ready; nothing was done")
        return self._check(message, number)

    @singledispatchmethod
    def _check(self, message: FromBrowser, number: int) -> Refusal | None:
        raise NotImplementedError(f"nothing checks {type(message).__name__}")

    @_check.register
    def _check_camera(self, message: wire.ViewerCameraMessage, _number: int) -> Refusal | None:
        if math.dist(message.position, message.look_at) < NEAREST_LOOK_M:
            return Refusal("a camera looks at the place where it is; expected another one")
        if math.hypot(*message.up_direction) < NEAREST_LOOK_M:
            return Refusal("a camera has no up; expected a direction")
        return _rotation_refusal(message.wxyz)

    @_check.register
    def _check_update(self, message: wire.GuiUpdateMessage, number: int) -> Refusal | None:
        widget = self._widget(number, message.uuid)
        if widget is None:
            return Refusal(GONE)
        name = getattr(widget, "label", "") or "a field"
        if tuple(message.updates) != ("value",):
            return Refusal(f"{name}: the page asks for {wire.shown(list(message.updates))}; expected its value only")
        if getattr(widget, "disabled", False):
            return Refusal(f"{name} cannot be used at the moment; nothing was done", message.uuid)
        value = message.updates["value"]
        problem = problem_with(widget, value)
        return None if problem is None else Refusal(f"{name}: {problem}", message.uuid)

    @_check.register
    def _check_hold(self, message: wire.GuiButtonHoldMessage, number: int) -> Refusal | None:
        button = self._widget(number, message.uuid)
        if not isinstance(button, GuiButtonHandle) or button.disabled:
            return Refusal(GONE)
        return None if viser_private.is_held(button, message.frequency) else Refusal(GONE)

    @_check.register
    def _check_form(self, message: wire.GuiFormSubmitMessage | wire.GuiFormDirtyMessage, number: int) -> Refusal | None:
        forms = (viser_private.form_of(gui, message.uuid) for gui in self._guis(number))
        return None if any(form is not None for form in forms) else Refusal(GONE)

    @_check.register
    def _check_command(self, message: wire.CommandTriggerMessage, number: int) -> Refusal | None:
        return None if any(viser_private.is_command(gui, message.uuid) for gui in self._guis(number)) else Refusal(GONE)

    @_check.register
    def _check_upload(
        self, message: wire.FileTransferStartUpload | wire.FileTransferPart, number: int
    ) -> Refusal | None:
        button = self._widget(number, message.source_component_uuid)
        return None if isinstance(button, GuiUploadButtonHandle) else Refusal(GONE)

    @_check.register
    def _check_gizmo_moved(self, message: wire.TransformControlsUpdateMessage, number: int) -> Refusal | None:
        return self._gizmo_refusal(number, message.owner, message.name) or _rotation_refusal(message.wxyz)

    @_check.register
    def _check_gizmo_held(
        self, message: wire.TransformControlsDragStartMessage | wire.TransformControlsDragEndMessage, number: int
    ) -> Refusal | None:
        return self._gizmo_refusal(number, message.owner, message.name)

    @_check.register
    def _check_pointer(self, message: wire.ScenePointerMessage, _number: int) -> Refusal | None:
        is_click = message.event_type == "click"
        has_ray = message.ray_origin is not None and message.ray_direction is not None
        if len(message.screen_pos) != (1 if is_click else 2) or (is_click and not has_ray):
            return Refusal("a click is incomplete; expected a place on the screen and a ray")
        return None

    @_check.register
    def _check_node(
        self, message: wire.SceneNodeClickMessage | wire.SceneNodeDragMessage, number: int
    ) -> Refusal | None:
        scene = self._scene(number, message.owner)
        is_there = scene is not None and viser_private.is_node(scene, number, message.name)
        return None if is_there else Refusal(GONE)

    def _gizmo_refusal(self, number: int, owner: str, name: str) -> Refusal | None:
        scene = self._scene(number, owner)
        is_there = scene is not None and viser_private.is_gizmo(scene, number, name)
        return None if is_there else Refusal(GONE)

    def _guis(self, number: int) -> Iterable[GuiApi]:
        """Where a browser's widgets are: among those of all browsers and among its own."""
        client = viser_private.client_of(self._server, number)
        return (self._server.gui,) if client is None else (self._server.gui, client.gui)

    def _widget(self, number: int, uuid: str) -> Any | None:
        found = (viser_private.widget_of(gui, uuid) for gui in self._guis(number))
        return next((widget for widget in found if widget is not None), None)

    def _scene(self, number: int, owner: str) -> SceneApi | None:
        client = viser_private.client_of(self._server, number)
        scenes = (self._server.scene,) if client is None else (self._server.scene, client.scene)
        return next((scene for scene in scenes if viser_private.owner_of(scene) == owner), None)

    def _refuse(self, number: int, refusal: Refusal) -> None:
        """Tell a refusal, and let the browser show what holds instead of what was refused."""
        log.debug("browser %d: %s", number, refusal.text)
        self._tell(number, refusal.text)
        widget = self._widget(number, refusal.widget) if refusal.widget else None
        if widget is not None and not isinstance(widget, GuiButtonHandle | GuiUploadButtonHandle):
            viser_private.show_value(self._server, number, widget)
            viser_private.say_at_field(self._server, number, refusal.widget, refusal.text)

    def _tell(self, number: int, text: str) -> None:
        """Tell a browser that something was refused, together with what else is refused until then."""
        note = self._notes.get(number)
        if note is not None:
            note.text, note.more = text, note.more + 1
            return
        self._notes[number] = _Note(text)
        self._loop.call_later(0.0, self._send_note, number)

    def _send_note(self, number: int) -> None:
        note = self._notes[number]
        if note.text:
            text = note.text + (f" (and {note.more} more)" if note.more else "")
            viser_private.notify(self._server, number, title="Not taken", text=text, seconds=TOLD_FOR_S)
            self._notes[number] = _Note("", -1)
            self._loop.call_later(TOLD_EVERY_S, self._send_note, number)
        else:
            del self._notes[number]


def _rotation_refusal(wxyz: tuple[float, float, float, float]) -> Refusal | None:
    """Refuse four numbers that are no rotation."""
    length = math.sqrt(sum(part * part for part in wxyz))
    return None if abs(length - 1.0) < 0.01 else Refusal(f"a rotation has the length {length:g}; expected 1")
