"""What a browser may say: one type per message of viser's page, with the bounds that hold whatever it is about.

It knows no widget and no viser. A type that is not here is never heard; what passes is encoded anew, so that nobody
behind can read something else out of the same bytes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, Literal, TypeAlias, get_args

import msgspec
from msgspec import Meta, Struct

LARGEST_PART = 1_048_576
"""Bytes of one part of an upload; viser's page sends 512 KiB."""
SHOWN_LENGTH = 60
"""Letters of a refused value that are shown."""

Identifier: TypeAlias = Annotated[str, Meta(max_length=64)]
NodeName: TypeAlias = Annotated[str, Meta(max_length=500)]
FileName: TypeAlias = Annotated[str, Meta(max_length=1000)]
Count: TypeAlias = Annotated[int, Meta(ge=0, le=2**53)]
Coordinate: TypeAlias = Annotated[float, Meta(ge=-1e9, le=1e9)]
Length: TypeAlias = Annotated[float, Meta(gt=0.0, le=1e12)]
Pixels: TypeAlias = Annotated[int, Meta(ge=1, le=100_000)]
Vector: TypeAlias = tuple[Coordinate, Coordinate, Coordinate]
Quaternion: TypeAlias = tuple[Coordinate, Coordinate, Coordinate, Coordinate]
OnScreen: TypeAlias = tuple[Coordinate, Coordinate]
Modifier: TypeAlias = Literal[
    "cmd/ctrl", "alt", "shift", "cmd/ctrl+alt", "cmd/ctrl+shift", "alt+shift", "cmd/ctrl+alt+shift"
]


class FromBrowser(Struct, frozen=True, forbid_unknown_fields=True, tag_field="type"):
    """Base of all messages; the name of a class is the message's type on the wire."""


class ViewerCameraMessage(FromBrowser, frozen=True, tag=True):
    """Where the browser looks from; the first one makes the connection a browser."""

    wxyz: Quaternion
    position: Vector
    fov: Annotated[float, Meta(gt=0.0, lt=math.pi)]
    near: Length
    far: Length
    image_height: Pixels
    image_width: Pixels
    look_at: Vector
    up_direction: Vector


class GuiUpdateMessage(FromBrowser, frozen=True, tag=True):
    """A field was changed or a button pressed."""

    uuid: Identifier
    updates: dict[str, Any]


class GuiButtonHoldMessage(FromBrowser, frozen=True, tag=True):
    """A button is held down."""

    uuid: Identifier
    frequency: Length


class GuiFormSubmitMessage(FromBrowser, frozen=True, tag=True):
    """A form was sent with Ctrl+Enter."""

    uuid: Identifier


class GuiFormDirtyMessage(FromBrowser, frozen=True, tag=True):
    """A field of a form was changed; told to the other browsers."""

    uuid: Identifier


class CommandTriggerMessage(FromBrowser, frozen=True, tag=True):
    """A key or an entry of the command palette was pressed."""

    uuid: Identifier


class FileTransferStartUpload(FromBrowser, frozen=True, tag=True):
    """A file is announced."""

    source_component_uuid: Identifier
    transfer_uuid: Identifier
    filename: FileName
    mime_type: FileName
    part_count: Count
    size_bytes: Count


class FileTransferPart(FromBrowser, frozen=True, tag=True):
    """A part of an announced file."""

    source_component_uuid: Identifier
    transfer_uuid: Identifier
    part_index: Count
    content: Annotated[bytes, Meta(max_length=LARGEST_PART)]


class TransformControlsUpdateMessage(FromBrowser, frozen=True, tag=True):
    """A gizmo was moved."""

    name: NodeName
    wxyz: Quaternion
    position: Vector
    owner: Identifier = ""


class TransformControlsDragStartMessage(FromBrowser, frozen=True, tag=True):
    """A gizmo was taken hold of."""

    name: NodeName
    owner: Identifier = ""


class TransformControlsDragEndMessage(FromBrowser, frozen=True, tag=True):
    """A gizmo was let go."""

    name: NodeName
    owner: Identifier = ""


class ScenePointerMessage(FromBrowser, frozen=True, tag=True):
    """A click on the floor, or a rectangle drawn over it."""

    event_type: Literal["click", "rect-select"]
    ray_origin: Vector | None
    ray_direction: Vector | None
    screen_pos: Annotated[tuple[OnScreen, ...], Meta(min_length=1, max_length=2)]
    modifier: Modifier | None


class SceneNodeClickMessage(FromBrowser, frozen=True, tag=True):
    """A click on something that stands in the scene."""

    name: NodeName
    instance_index: Count | None
    ray_origin: Vector
    ray_direction: Vector
    screen_pos: OnScreen
    modifier: Modifier | None
    owner: Identifier = ""


class SceneNodeDragMessage(FromBrowser, frozen=True, tag=True):
    """Something in the scene is dragged."""

    phase: Literal["start", "update", "end"]
    name: NodeName
    instance_index: Count | None
    start_position: Vector
    start_screen_pos: OnScreen
    end_position: Vector
    end_screen_pos: OnScreen
    button: Literal["left", "middle", "right"]
    modifier: Modifier | None
    owner: Identifier = ""


AnyMessage: TypeAlias = (
    ViewerCameraMessage
    | GuiUpdateMessage
    | GuiButtonHoldMessage
    | GuiFormSubmitMessage
    | GuiFormDirtyMessage
    | CommandTriggerMessage
    | FileTransferStartUpload
    | FileTransferPart
    | TransformControlsUpdateMessage
    | TransformControlsDragStartMessage
    | TransformControlsDragEndMessage
    | ScenePointerMessage
    | SceneNodeClickMessage
    | SceneNodeDragMessage
)
MESSAGES: tuple[type[FromBrowser], ...] = get_args(AnyMessage)

_DECODER = msgspec.msgpack.Decoder(AnyMessage)


@dataclass(frozen=True, slots=True)
class Refusal:
    """Why something that a browser said is not heard."""

    text: str
    """Where, what was found, what is expected: one line for whoever sits at that browser."""
    widget: str = ""
    """Identifier of the field that now shows what was refused; empty when there is none."""


def parsed(raw: bytes | str) -> AnyMessage | Refusal:
    """Read one message, or say why it is none."""
    if isinstance(raw, str):
        return Refusal(f"a message of the page is the text {shown(raw)}; expected msgpack")
    try:
        message = _DECODER.decode(raw)
    except (msgspec.MsgspecError, RecursionError, ValueError) as error:
        return Refusal(f"a message of the page cannot be read: {error}"[:300])
    infinite = _not_finite(message)
    if infinite is not None:
        return Refusal(f"{type(message).__name__}: found {shown(infinite)}; expected finite numbers")
    return message


def encoded(message: AnyMessage) -> bytes:
    """Write a message as viser reads it."""
    return msgspec.msgpack.encode(message)


def shown(value: object) -> str:
    """Return a value as a refusal quotes it: on one line, and not longer than a line."""
    text = f"{value:g}" if isinstance(value, float) else repr(value)
    return text if len(text) <= SHOWN_LENGTH else f"{text[:SHOWN_LENGTH]}…"


def _not_finite(value: object) -> float | None:
    """Return the first number in a message that is none; msgspec's bounds let NaN pass."""
    match value:
        case float():
            return None if math.isfinite(value) else value
        case Struct():
            parts: Any = (getattr(value, name) for name in value.__struct_fields__)
        case tuple() | list():
            parts = value
        case dict():
            parts = value.values()
        case _:
            return None
    return next((found for part in parts if (found := _not_finite(part)) is not None), None)
