"""What each browser looks at: plan (north up, as good as orthographic) or 3D, fitted to the site or on the vehicle.

All browsers share one scene; the camera, and what only plan or 3D needs, belong to one browser.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Coroutine, Sequence
from dataclasses import dataclass, field
from threading import Lock
from typing import Any, TypeAlias

import numpy as np
import viser
from viser import CameraHandle, ClientHandle, SceneNodeHandle

from commission.app.base import viser_private
from commission.app.base.actions import Camera, Point
from commission.app.base.extent import Extent
from commission.app.base.layer import Layer
from commission.app.base.map_scene import SceneOrigin, origin_for

PLAN_FOV = 0.02
"""Vertical opening of the camera in the plan [rad]: from so far away that heights do not shift anything."""
THREE_D_FOV = 0.85
ASPECT_AT_START = 1.7
FOLLOWED_HEIGHT = 6.0
"""Visible height when the vehicle is first followed in the plan [m]."""
NEAREST_FLIGHT = 8.0
"""Visible height when a place is flown to from farther away [m]."""
STRAIGHT_DOWN = np.array([0.0, 1.0, 0.0, 0.0])
LOCK = "/lock"
SHEET = 10_000.0 * np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
"""Corners of what is under everything that can be seen, about the scene's origin [m]."""
BUILDS_UP = 60.0
"""Time after a browser came in which it shows the whole site, unless a person moves the floor [s].

How long its page takes is not known: where a processor draws for many windows, ten seconds until the first picture, and
viser puts the camera that it began with back once more after a browser has shown another one.
"""

OnDrag: TypeAlias = Callable[[Any], Coroutine[Any, Any, None]]
"""Takes viser's drag events of the floor; `async`, since only those keep their order."""


@dataclass(slots=True, kw_only=True)
class ClientView:
    """What one browser looks at."""

    client: ClientHandle
    """The browser."""
    three_d: bool = False
    """Whether it is the 3D view."""
    follow: bool = False
    """Whether the camera goes with the vehicle."""
    furniture: dict[str, tuple[SceneNodeHandle, ...]] = field(default_factory=dict)
    """Its own nodes by layer."""
    aspect: float = 0.0
    """Shape of the floor, width over height, that the plan was fitted to."""
    fitted: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where the camera was put to show the whole site [m]."""
    extent: Extent | None = None
    """What it was fitted to: the site as it was then."""
    is_fitted: bool = False
    """Whether the browser has shown the whole site."""
    is_settled: bool = False
    """Whether a person has moved the floor, or time is up: what it shows is its own then."""
    is_whole: bool = False
    """Whether its page has been told that it shows the whole site."""
    came_at: float = field(default_factory=time.monotonic)
    """When it came, on the clock of this computer [s]."""


class Cameras:
    """The views of all browsers, in map coordinates; called by the owner thread alone.

    Parameters
    ----------
    server : a started one.
    layers : everything that is drawn on the floor.
    extent : of the site.
    origin : of the scene.
    on_drag : takes drags of the floor; none: they do nothing.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        layers: Sequence[Layer],
        extent: Extent,
        origin: SceneOrigin,
        *,
        on_drag: OnDrag | None = None,
    ) -> None:
        self._on_drag = on_drag or _ignore
        self._server = server
        self._layers = layers
        self._extent = extent
        self._origin = origin
        self._views: dict[int, ClientView] = {}
        self._target: tuple[float, float] | None = None
        # A browser's reports are heard by the server's own thread: where it fits while the owner does, the camera that
        # is sent last has to be the one that is remembered.
        self._fitting = Lock()
        self._begin_at(extent)

    def _begin_at(self, extent: Extent) -> None:
        """Put the scene's origin near the site, and the camera that a browser begins with above it."""
        place = origin_for(extent, self._origin.place)
        if place != self._origin.place:
            self._origin.move(place)
            viser_private.run_on_pages(self._server, f"window.commissionOrigin = {json.dumps(place)}")
        height = _visible_height(extent, ASPECT_AT_START) / PLAN_FOV
        start = self._server.initial_camera
        x, y, _ = map(float, self._origin.to_scene((*extent.center, 0.0)))
        start.position, start.look_at, start.up = (x, y, height), (x, y, 0.0), (0.0, 1.0, 0.0)
        start.fov, start.near, start.far = PLAN_FOV, _nearest(height), 6.0 * height

    def connected(self, client: ClientHandle) -> None:
        """Begin with the plan of the whole site."""
        self._views[client.client_id] = ClientView(client=client)
        self._let_hand_win(client)
        client.camera.on_update(self._watch)
        self._furnish(self._views[client.client_id])
        self.show(client.client_id, Camera.FIT)

    def _let_hand_win(self, client: ClientHandle) -> None:
        """Fit nothing anew once the floor is zoomed or moved by hand: the page's script tells (floor_view.js)."""
        moved = client.gui.add_checkbox("The floor was moved by hand", False, visible=False)
        told = json.dumps(viser_private.identifier(moved))
        script = f"window.commissionMoved = {told}; window.commissionStands = window.commissionWhole = false"
        viser_private.run_on_page(self._server, client.client_id, script)
        own = self._views[client.client_id]

        def settle(_event: object) -> None:
            # A wheel turned before the plan was there zooms nothing that anybody has seen.
            if own.is_fitted:
                own.is_settled = True
                viser_private.run_on_page(self._server, client.client_id, "window.commissionStands = true")

        moved.on_update(settle)

    def disconnected(self, client_id: int) -> None:
        """Forget a browser; its nodes went with it."""
        self._views.pop(client_id, None)

    def show(self, client_id: int, wanted: Camera) -> None:
        """Change what a browser looks at; one that is gone is ignored."""
        own = self._views.get(client_id)
        if own is None:
            return
        if wanted is Camera.FOLLOW:
            own.follow = not own.follow
            if own.follow and self._target is not None and not own.three_d:
                self._look_down(own.client, self._target, FOLLOWED_HEIGHT)
            self._light(own)
            return
        own.follow = False
        if wanted is not Camera.FIT and own.three_d is not (wanted is Camera.THREE_D):
            own.three_d = wanted is Camera.THREE_D
            self._furnish(own)
        self._light(own)
        if own.three_d:
            self._look_from_the_south(own.client)
        else:
            self._fit(own)

    def _light(self, own: ClientView) -> None:
        """Let a browser's page light the buttons of what it looks at (the style of the bar)."""
        looks = [Camera.THREE_D if own.three_d else Camera.PLAN, *([Camera.FOLLOW] if own.follow else [])]
        lit = json.dumps(" ".join(looks))
        viser_private.run_on_page(
            self._server, own.client.client_id, f"document.documentElement.dataset.camera = {lit}"
        )

    def look_at(self, client_id: int, place: Point) -> None:
        """Bring a place into the middle of a browser's view, near enough to see it."""
        own = self._views.get(client_id)
        if own is None:
            return
        own.follow, own.is_settled = False, True
        self._light(own)
        camera = self._origin.camera(own.client)
        distance = float(np.linalg.norm(camera.position - camera.look_at))
        if not own.three_d:
            self._look_down(own.client, place, min(distance * PLAN_FOV, NEAREST_FLIGHT))
            return
        target = np.array([*place, 0.0])
        away = camera.position - camera.look_at
        with own.client.atomic():
            camera.position = target + away * min(1.0, NEAREST_FLIGHT / max(distance, 1e-6))
            camera.look_at = target

    def show_layer(self, name: str, *, visible: bool) -> None:
        """Show or hide a layer's nodes in the browsers that have some of their own."""
        for own in self._views.values():
            for node in own.furniture.get(name, ()):
                node.visible = visible

    def refurnish(self, changed: frozenset[str], extent: Extent, hidden: frozenset[str]) -> None:
        """Make the browsers' own nodes of these layers anew, after the project changed.

        Parameters
        ----------
        changed : names of the layers whose parts of the project have changed.
        extent : of the site as it is now.
        hidden : names of the layers that are switched off.
        """
        before, self._extent = self._origin.place, extent
        self._begin_at(extent)
        for own in self._views.values():
            self._furnish_layers(own, changed)
            if self._origin.place != before:
                self.show(own.client.client_id, Camera.FIT)
        for name in hidden & changed:
            self.show_layer(name, visible=False)

    def follow(self, place: Point) -> None:
        """Move the cameras that follow what moves."""
        self._target = place
        target = np.array([*self._target, 0.0])
        for own in self._views.values():
            if own.follow:
                camera = self._origin.camera(own.client)
                shift = target - camera.look_at
                with own.client.atomic():
                    camera.position = camera.position + shift
                    camera.look_at = target

    def _furnish(self, own: ClientView) -> None:
        """Replace all of a browser's own nodes."""
        self._furnish_layers(own, frozenset(layer.name for layer in self._layers))
        for node in own.furniture.pop(LOCK, ()):
            node.remove()
        if not own.three_d:
            own.furniture[LOCK] = (self._rotation_lock(own.client),)

    def _furnish_layers(self, own: ClientView, names: frozenset[str]) -> None:
        """Replace a browser's own nodes of some layers."""
        for layer in self._layers:
            if layer.name in names:
                for node in own.furniture.get(layer.name, ()):
                    node.remove()
                own.furniture[layer.name] = layer.furnish(self._origin.scene(own.client.scene), three_d=own.three_d)

    def _fit(self, own: ClientView, extent: Extent | None = None) -> None:
        """Show the plan of the whole site, or as large as it was."""
        with self._fitting:
            own.extent = extent or self._extent
            own.aspect, own.fitted = _aspect(own.client), _whole(own.extent, own.client)
            self._look_down(own.client, own.extent.center, own.fitted[2] * PLAN_FOV)

    def _look_down(self, client: ClientHandle, center: tuple[float, float], visible_height: float) -> None:
        distance = visible_height / PLAN_FOV
        camera = self._origin.camera(client)
        with client.atomic():
            fitted = _visible_height(self._extent, _aspect(client)) / PLAN_FOV
            camera.fov, camera.near, camera.far = PLAN_FOV, _nearest(fitted), 6.0 * fitted
            camera.min_orbit_distance, camera.max_orbit_distance = 2.0 * _nearest(fitted), 4.0 * fitted
            camera.up_direction = (0.0, 1.0, 0.0)
            camera.position = (*center, distance)
            camera.look_at = (*center, 0.0)

    def _look_from_the_south(self, client: ClientHandle) -> None:
        x, y = self._extent.center
        reach = _visible_height(self._extent, _aspect(client))
        camera = self._origin.camera(client)
        with client.atomic():
            camera.fov, camera.near, camera.far = THREE_D_FOV, 0.05, 50.0 * reach
            camera.min_orbit_distance, camera.max_orbit_distance = 0.5, 20.0 * reach
            camera.up_direction = (0.0, 0.0, 1.0)
            camera.position = (x, y - 0.85 * reach, 0.85 * reach)
            camera.look_at = (x, y, 0.0)

    async def _watch(self, moved: CameraHandle) -> None:
        """Fit anew while the page still builds up, and keep north up afterwards.

        A browser reports the camera that it began with, and the floor takes its shape when the panels have come: a plan
        fitted before that shows a corner of the site. Later the floor changes its shape with the window, or when the
        plots are folded: who had the whole site in view keeps it.
        """
        own, camera = self._views.get(moved.client.client_id), self._origin.camera(moved.client)
        if own is None or own.three_d or own.follow:
            return
        with self._fitting:
            is_reshaped = abs(_aspect(own.client) - own.aspect) > 0.01
            was_fitted = self._is_at(camera, own.fitted)
        is_whole = self._is_at(camera, _whole(own.extent or self._extent, own.client))
        self._tell_whether_whole(own, is_whole=is_whole)
        own.is_fitted = own.is_fitted or is_whole
        own.is_settled = own.is_settled or time.monotonic() - own.came_at > BUILDS_UP
        # Before, not only where the shape has changed: what was sent for a shape before may have come last.
        is_due = is_reshaped and was_fitted if own.is_settled else not is_whole
        if is_due:
            # A map that is loaded or taken back meanwhile moves no camera by itself.
            self._fit(own, self._extent if own.is_settled else own.extent)
            return
        self._keep_north_up(camera)

    def _tell_whether_whole(self, own: ClientView, *, is_whole: bool) -> None:
        """Let a page know whether it shows the whole site: a reload does so again, in its own shape (kept_view.js)."""
        if is_whole is not own.is_whole:
            own.is_whole = is_whole
            script = f"window.commissionWhole = {json.dumps(is_whole)}"
            viser_private.run_on_page(self._server, own.client.client_id, script)

    def _is_at(self, camera: CameraHandle, place: tuple[float, float, float]) -> bool:
        """Whether a camera is where it was put, or would be [m]."""
        away = np.abs(camera.position - place)
        return bool(np.all(away <= 1e-3 * np.array([*self._extent.size, place[2]])))

    def _rotation_lock(self, client: ClientHandle) -> SceneNodeHandle:
        """Put a sheet under everything that takes left drags: the camera would turn by them, and north not stay up.

        Its edges are all that is drawn of it, invisibly: filled, it took half the time of a picture where no graphics
        card draws, for a light that nobody sees at each pixel. Between the edges it is met all the same.
        """
        sheet = self._origin.scene(client.scene).add_mesh_simple(
            LOCK,
            vertices=SHEET,
            faces=np.array([[0, 1, 2], [0, 2, 3]]),
            position=(*self._origin.place, -1.0),
            opacity=0.0,
            wireframe=True,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )
        sheet.on_drag("left")(self._on_drag)
        sheet.on_drag("left", modifier="shift")(self._on_drag)
        return sheet

    def _keep_north_up(self, camera: CameraHandle) -> None:
        """Undo a turn by the arrow keys, which cannot be switched off."""
        if abs(abs(float(camera.wxyz @ STRAIGHT_DOWN)) - 1.0) < 1e-6:
            return
        distance = float(np.linalg.norm(camera.position - camera.look_at))
        x, y = (float(value) for value in camera.look_at[:2])
        with camera.client.atomic():
            camera.up_direction = (0.0, 1.0, 0.0)
            camera.position = (x, y, distance)
            camera.look_at = (x, y, 0.0)


def _whole(extent: Extent, client: ClientHandle) -> tuple[float, float, float]:
    """Where a camera shows the plan of a whole rectangle on a browser's floor as it is shaped now [m]."""
    x, y = extent.center
    return x, y, _visible_height(extent, _aspect(client)) / PLAN_FOV


def _visible_height(extent: Extent, aspect: float) -> float:
    """Height of the floor [m] that shows the whole rectangle."""
    width, height = extent.size
    return 1.04 * max(height, width / aspect)


def _nearest(fitted_distance: float) -> float:
    """Distance before which the plan draws nothing [m]: as far as zooming allows, for the sake of depth."""
    return fitted_distance / 50.0


def _aspect(client: ClientHandle) -> float:
    """Width of a browser's floor over its height."""
    aspect = float(client.camera.aspect)
    return aspect if 0.2 < aspect < 8.0 else ASPECT_AT_START


async def _ignore(_event: object) -> None:
    """Take a drag of the floor so that the camera does not."""
