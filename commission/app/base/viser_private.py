"""viser's private names, all that are used: what the server needs and viser 1.1 offers no other way to.

Nothing else in this project touches a name of viser's that begins with an underscore; a test names each of them.
"""

from __future__ import annotations

import asyncio
import json
import logging
import uuid
from collections.abc import AsyncGenerator, Callable, Iterable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextvars import ContextVar
from dataclasses import replace
from typing import Any, TypeVar, cast

import numpy as np
import viser
from numpy.typing import NDArray
from viser import (
    ClientHandle,
    GuiApi,
    GuiButtonHandle,
    GuiEvent,
    GuiFormHandle,
    GuiSliderHandle,
    SceneApi,
    ViserServer,
    _messages,
    _scene_api,
    _viser,
)
from viser.infra import WebsockServer

log = logging.getLogger(__name__)

Result = TypeVar("Result")

HANDLER_MODULE = WebsockServer.__module__
"""Module of the function that viser gives to websockets' `serve`."""
SUBPROTOCOL = f"viser-v{viser.__version__}"
"""What a page of this viser says that it speaks."""


class LoopEvent(asyncio.Event):
    """An event that is set by its loop alone.

    viser sets a plain one from whatever thread writes to the page, while the loop goes through the same list of
    waiting browsers: "deque mutated during iteration". It asks the loop to set it as well, after each message or at the
    end of those that belong together: what is set before that would wake the loop for nothing, once or more often in
    each picture.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        super().__init__()
        self._of_loop = loop

    def set(self) -> None:
        """Wake who waits, in the loop's own thread; from another one the loop has been asked, or will be."""
        try:
            is_here = asyncio.get_running_loop() is self._of_loop
        except RuntimeError:
            is_here = False
        if is_here:
            super().set()


def write_array(node: Any, name: str, array: NDArray[np.float32]) -> None:
    """Set a property of a node of the scene, as setting it does, without viser's three copies and its look at types.

    Parameters
    ----------
    node : a handle of viser's.
    name : of the property.
    array : which nobody writes into from now on.
    """
    held = getattr(node, name)
    if node._impl.removed or held.dtype != array.dtype:
        setattr(node, name, array)
    elif not np.array_equal(held, array):
        setattr(node._impl.props, name, array)
        node._queue_update(name, array)


def write_position(node: Any, place: tuple[float, ...]) -> None:
    """Put a node where it belongs, however near that is to where it was: viser passes over a 100,000th part of the way.

    Parameters
    ----------
    node : a handle of viser's.
    place : (3,) [m], frame of the parent node.
    """
    if not np.array_equal(node._impl.position, place):
        # Nothing is near to what is no number.
        node._impl.position[:] = np.nan
        node.position = place


class Said:
    """A widget with the value that a person gave it, whatever has been written to it since."""

    __slots__ = ("_widget", "value")

    def __init__(self, widget: Any, value: Any) -> None:
        self._widget = widget
        self.value = value

    def __getattr__(self, name: str) -> Any:
        """Return anything else as the widget has it now."""
        return getattr(self._widget, name)


_ENTERED: ContextVar[tuple[str, Any] | None] = ContextVar("entered", default=None)
"""Widget and value of the message that the loop carries out at the moment; None when it enters no value."""


def carry_out(widget: str, value: Any) -> None:
    """Say which value is being entered by the message that this task of the loop carries out from now on."""
    _ENTERED.set((widget, value))


def _as_said(argument: Any) -> Any:
    """Return an event with the value that came with it."""
    if not isinstance(argument, GuiEvent) or not hasattr(argument.target, "value"):
        return argument
    widget: Any = argument.target
    entered = _ENTERED.get()
    value = widget.value
    if entered is not None and entered[0] == identifier(widget):
        # As viser casts what comes over the wire; between that and here the page may have written to the widget.
        value = _cast(entered[1], value)
    return replace(argument, target=Said(widget, value))


def _cast(value: Any, held: Any) -> Any:
    """Return what came over the wire in the type of what a widget holds."""
    if isinstance(held, tuple):
        return tuple(type(one)(each) for one, each in zip(cast("tuple[Any, ...]", held), value, strict=True))
    return type(held)(value)


class Callbacks(ThreadPoolExecutor):
    """Runs the callbacks of widgets one after the other, so that what they post arrives as it was done.

    viser runs them in 32 threads, in no order, and prints what they raise to the terminal. And it hands them the widget
    itself: where the page, which does not know yet what a person did, writes what holds to it before a callback has
    read it, that would be lost.
    """

    def __init__(self) -> None:
        super().__init__(max_workers=1, thread_name_prefix="callbacks")

    def submit(self, fn: Callable[..., Result], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Queue a call with what a person has said by now; what it raises is logged."""
        said = tuple(_as_said(each) for each in args)

        def reporting() -> Result | None:
            try:
                return fn(*said, **kwargs)
            except Exception as error:
                report(error)
                return None

        return super().submit(reporting)


def report(error: BaseException) -> None:
    """Log what a callback raised."""
    log.error("a callback of the page failed", exc_info=error)


def make_robust(server: ViserServer) -> None:
    """Mend a started server to which no browser has connected yet.

    What other threads write is announced on the server's own loop; callbacks run in order; errors are logged; a write
    to a browser that has just gone is nothing to warn about.
    """
    loop = event_loop(server)
    callbacks = Callbacks()
    server._thread_executor.shutdown(wait=False)
    for part in (server, server.gui, server.scene):
        part._thread_executor = callbacks
    # Each module has its own name of the function that prints.
    for module in (_scene_api, _viser):
        setattr(module, "print_awaited_callback_error", report)  # noqa: B010  (pyright knows no such name)
    loop.set_exception_handler(_report_of_loop)
    server._websock_server.get_message_buffer().message_event = LoopEvent(loop)

    def prepare(connection: Any) -> None:
        buffer = connection.get_message_buffer()
        buffer.message_event = LoopEvent(loop)
        buffer._warned_push_after_done = True

    server._websock_server.on_client_connect(prepare)


def repaint(server: ViserServer, is_due: Callable[[str | None], bool], paint: Callable[[Any], Any]) -> None:
    """Paint what some browsers get otherwise, from their connection on.

    Parameters
    ----------
    server : a started one to which no browser has connected yet.
    is_due : decides by the cookies of a browser.
    paint : from a message to the one that is sent in its place; the message itself is for the others, too.
    """
    socket = server._websock_server

    def watch(buffer: Any) -> None:
        plain = buffer.window_generator

        def windows(client_id: int, *args: Any, **options: Any) -> AsyncGenerator[Sequence[Any], None]:
            found = plain(client_id, *args, **options)
            connection = socket._live_connections.get(client_id)
            request = None if connection is None else connection.request
            return _painted(found, paint) if request and is_due(request.headers.get("Cookie")) else found

        buffer.window_generator = windows

    watch(socket.get_message_buffer())
    socket.on_client_connect(lambda connection: watch(connection.get_message_buffer()))


async def _painted(
    windows: AsyncGenerator[Sequence[Any], None], paint: Callable[[Any], Any]
) -> AsyncGenerator[Sequence[Any], None]:
    """Windows of messages as one browser gets them; pictures beside the loop, since a floor map takes its time."""
    try:
        async for window in windows:
            if any(isinstance(message, _messages.ImageMessage) for message in window):
                yield await asyncio.to_thread(lambda window=window: [paint(message) for message in window])
            else:
                yield [paint(message) for message in window]
    finally:
        await windows.aclose()


def _report_of_loop(_loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    error = context.get("exception")
    log.error("the page's server: %s", context["message"], exc_info=error)


def event_loop(server: ViserServer) -> asyncio.AbstractEventLoop:
    """Return the loop in which messages are sent and heard."""
    return server._event_loop


def listening_port(server: ViserServer) -> int:
    """Return the port that viser's server has really bound."""
    return server._websock_server._port


def number_of(server: ViserServer, connection: object) -> int | None:
    """Return viser's number of a connection; none before viser knows it and after it has gone."""
    live = server._websock_server._live_connections
    return next((number for number, known in tuple(live.items()) if known is connection), None)


def client_of(server: ViserServer, number: int) -> ClientHandle | None:
    """Return a connected browser; cheaper than a copy of all of them."""
    return server._connected_clients.get(number)


def send(server: ViserServer, number: int, message: Any) -> None:
    """Queue a message for one connection; nothing happens when it has gone.

    Parameters
    ----------
    server : of the page.
    number : of the connection.
    message : one of viser's.
    """
    state = server._websock_server._client_state_from_id.get(number)
    if state is not None:
        state.message_buffer.push(message)


def notify(server: ViserServer, number: int, *, title: str, text: str, seconds: float) -> None:
    """Show a red note in one browser.

    Parameters
    ----------
    server : of the page.
    number : of the connection.
    title, text : of the note; plain text.
    seconds : until it goes [s].
    """
    props = _messages.NotificationProps(title, text, False, True, seconds, "red")
    send(server, number, _messages.NotificationShowMessage(uuid.uuid4().hex, props))


def show_value(server: ViserServer, number: int, widget: Any) -> None:
    """Let one browser show the value that a widget has here.

    Parameters
    ----------
    server : of the page.
    number : of the connection.
    widget : a handle that has a value.
    """
    send(server, number, _messages.GuiUpdateMessage(identifier(widget), {"value": widget.value}))


def write_anew(gui: GuiApi, widget: Any) -> None:
    """Let the page show the value that a widget has here, though it has not changed here: it may show another one.

    Parameters
    ----------
    gui : that the widget is of.
    widget : a handle that has a value.
    """
    gui._websock_interface.queue_message(_messages.GuiUpdateMessage(identifier(widget), {"value": widget.value}))


def say_at_field(server: ViserServer, number: int, widget: str, text: str) -> None:
    """Let one browser say below a field why its entry was refused; nothing where it does not show that field.

    Parameters
    ----------
    server : of the page.
    number : of the connection.
    widget : its identifier.
    text : plain text.
    """
    run_on_page(server, number, f"window.commissionRefuse?.({json.dumps(widget)}, {json.dumps(text)})")


def take_back_refusals(gui: GuiApi, widgets: Iterable[Any]) -> None:
    """Take back what is said below fields: they show another thing's values, of which nothing was refused.

    Parameters
    ----------
    gui : that the widgets are of.
    widgets : handles of inputs.
    """
    names = json.dumps([identifier(widget) for widget in widgets])
    gui._websock_interface.queue_message(_messages.RunJavascriptMessage(f"window.commissionTakeBack?.({names})"))


def run_on_pages(server: ViserServer, script: str) -> None:
    """Let every browser, also those that come later, run a script of ours."""
    server._websock_server.queue_message(_messages.RunJavascriptMessage(script))


def run_on_page(server: ViserServer, number: int, script: str) -> None:
    """Let one browser run a script of ours.

    Parameters
    ----------
    server : of the page.
    number : of the connection.
    script : what it runs.
    """
    send(server, number, _messages.RunJavascriptMessage(script))


def tick(slider: GuiSliderHandle[Any], place: float | None) -> None:
    """Put one tick on a slider, in place of those it has; None: take it away."""
    marks = None if place is None else (_messages.GuiSliderMark(place, None),)
    if slider._marks != marks:
        slider._marks = marks


def identifier(widget: Any) -> str:
    """Return the identifier under which browsers speak of a widget."""
    return widget._impl.uuid


def widget_of(gui: GuiApi, name: str) -> Any | None:
    """Return the input or button with an identifier."""
    return gui._gui_input_handle_from_uuid.get(name)


def form_of(gui: GuiApi, name: str) -> GuiFormHandle | None:
    """Return the form with an identifier."""
    container = gui._container_handle_from_uuid.get(name)
    return container if isinstance(container, GuiFormHandle) else None


def is_command(gui: GuiApi, name: str) -> bool:
    """Whether a key or entry of the command palette has this identifier and can be used."""
    command = gui._command_handle_from_uuid.get(name)
    return command is not None and not command.disabled


def is_held(button: GuiButtonHandle, frequency: float) -> bool:
    """Whether anything listens to a button being held at this rate."""
    return frequency in button._button_impl.hold_cbs_from_freq


def is_gizmo(scene: SceneApi, number: int, name: str) -> bool:
    """Whether a gizmo has this name, or had it when the browser took hold of it.

    Parameters
    ----------
    scene : of the page, or of one browser.
    number : of the connection.
    name : of the node, as the browser says it.
    """
    return name in scene._handle_from_transform_controls_name or (number, name) in scene._active_transform_drag_handles


def is_node(scene: SceneApi, number: int, name: str) -> bool:
    """Whether something in the scene has this name, or had it when the browser began to drag it.

    Parameters
    ----------
    scene : of the page, or of one browser.
    number : of the connection.
    name : of the node, as the browser says it.
    """
    return name in scene._handle_from_node_name or (number, name) in scene._active_drag_handles


def owner_of(scene: SceneApi) -> str:
    """Return the name by which messages call this scene: empty for that of all browsers."""
    return scene._owner_id


def server_of(gui: GuiApi) -> ViserServer:
    """Return the server that a set of widgets belongs to, be it that of all browsers or one browser's own."""
    owner = gui._owner
    return owner if isinstance(owner, ViserServer) else owner._viser_server


def on_leave(server: ViserServer, callback: Callable[[int], None]) -> None:
    """Call a function with the number of each connection that ends, on the server's loop."""
    server._websock_server.on_client_disconnect(lambda connection: callback(connection.client_id))


def take_uploads(gui: GuiApi, begin: Callable[[int, Any], None], part: Callable[[int, Any], None]) -> None:
    """Put two functions in the place of viser's own, which collects whatever comes and tells it to all browsers.

    Parameters
    ----------
    gui : of the page.
    begin : takes the number of the connection and the message that announces a file.
    part : takes the number of the connection and the message with a part of one.
    """
    socket = gui._websock_interface
    socket.unregister_handler(_messages.FileTransferStartUpload, gui._handle_file_transfer_start)
    socket.unregister_handler(_messages.FileTransferPart, gui._handle_file_transfer_part)
    socket.register_handler(_messages.FileTransferStartUpload, begin)
    socket.register_handler(_messages.FileTransferPart, part)


def acknowledge(server: ViserServer, number: int, message: Any, done: int, whole: int) -> None:
    """Tell a browser how much of its file has come.

    Parameters
    ----------
    server : of the page.
    number : of the connection.
    message : with the part that came last.
    done, whole : bytes that have come, and bytes of the file.
    """
    ack = _messages.FileTransferPartAck(message.source_component_uuid, message.transfer_uuid, done, whole)
    send(server, number, ack)


def replace_upload_note(server: ViserServer, number: int, transfer: str, text: str) -> None:
    """Write over what a browser itself says of its upload.

    Parameters
    ----------
    server : of the page.
    number : of the connection.
    transfer : identifier of the upload.
    text : why the file is not taken; plain text.
    """
    props = _messages.NotificationProps("Not taken", text, False, True, 10.0, "red")
    send(server, number, _messages.NotificationUpdateMessage(f"upload-{transfer}", props))
