"""What each browser looks at: plan (north up, as good as orthographic) or 3D, fitted to the site or on the vehicle.

All browsers share one scene; the camera, and what only plan or 3D needs, belong to one browser.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import viser
from viser import CameraHandle, ClientHandle, SceneNodeHandle

from commission.app.actions import View
from commission.app.extent import Extent
from commission.app.layers.base import Layer
from commission.app.view import RunView

PLAN_FOV = 0.02
"""Vertical opening of the camera in the plan [rad]: from so far away that heights do not shift anything."""
THREE_D_FOV = 0.85
ASPECT_AT_START = 1.7
FOLLOWED_HEIGHT = 6.0
"""Visible height when the vehicle is first followed in the plan [m]."""
STRAIGHT_DOWN = np.array([0.0, 1.0, 0.0, 0.0])
LOCK = "/lock"


@dataclass(slots=True)
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


class Cameras:
    """The views of all browsers; called by the owner thread alone."""

    def __init__(self, server: viser.ViserServer, layers: Sequence[Layer], extent: Extent) -> None:
        self._server = server
        self._layers = layers
        self._extent = extent
        self._views: dict[int, ClientView] = {}
        self._target: tuple[float, float] | None = None
        height = _visible_height(extent, ASPECT_AT_START) / PLAN_FOV
        start = server.initial_camera
        x, y = extent.center
        start.position, start.look_at, start.up = (x, y, height), (x, y, 0.0), (0.0, 1.0, 0.0)
        start.fov, start.near, start.far = PLAN_FOV, _nearest(height), 6.0 * height

    def connected(self, client: ClientHandle) -> None:
        """Begin with the plan of the whole site."""
        self._views[client.client_id] = ClientView(client)
        client.camera.on_update(self._keep_north_up)
        self._furnish(self._views[client.client_id])
        self.show(client.client_id, View.FIT)

    def disconnected(self, client_id: int) -> None:
        """Forget a browser; its nodes went with it."""
        self._views.pop(client_id, None)

    def show(self, client_id: int, view: View) -> None:
        """Change what a browser looks at; one that is gone is ignored."""
        own = self._views.get(client_id)
        if own is None:
            return
        if view is View.FOLLOW:
            own.follow = not own.follow
            if own.follow and self._target is not None and not own.three_d:
                self._look_down(own.client, self._target, FOLLOWED_HEIGHT)
            return
        own.follow = False
        if view is not View.FIT and own.three_d is not (view is View.THREE_D):
            own.three_d = view is View.THREE_D
            self._furnish(own)
        if own.three_d:
            self._look_from_the_south(own.client)
        else:
            self._look_down(own.client, self._extent.center, _visible_height(self._extent, _aspect(own.client)))

    def show_layer(self, name: str, *, visible: bool) -> None:
        """Show or hide a layer's nodes in the browsers that have some of their own."""
        for own in self._views.values():
            for node in own.furniture.get(name, ()):
                node.visible = visible

    def refurnish(self, hidden: frozenset[str]) -> None:
        """Make every browser's own nodes anew, after the project changed."""
        for own in self._views.values():
            self._furnish(own)
        for name in hidden:
            self.show_layer(name, visible=False)

    def follow(self, run: RunView) -> None:
        """Move the cameras that follow the vehicle."""
        self._target = (float(run.pose[0]), float(run.pose[1]))
        target = np.array([*self._target, 0.0])
        for own in self._views.values():
            if own.follow:
                camera = own.client.camera
                shift = target - camera.look_at
                with own.client.atomic():
                    camera.position = camera.position + shift
                    camera.look_at = target

    def _furnish(self, own: ClientView) -> None:
        """Replace a browser's own nodes."""
        for nodes in own.furniture.values():
            for node in nodes:
                node.remove()
        scene = own.client.scene
        own.furniture = {layer.name: layer.furnish(scene, three_d=own.three_d) for layer in self._layers}
        if not own.three_d:
            own.furniture[LOCK] = (_rotation_lock(own.client),)

    def _look_down(self, client: ClientHandle, center: tuple[float, float], visible_height: float) -> None:
        distance = visible_height / PLAN_FOV
        camera = client.camera
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
        camera = client.camera
        with client.atomic():
            camera.fov, camera.near, camera.far = THREE_D_FOV, 0.05, 50.0 * reach
            camera.min_orbit_distance, camera.max_orbit_distance = 0.5, 20.0 * reach
            camera.up_direction = (0.0, 0.0, 1.0)
            camera.position = (x, y - 0.85 * reach, 0.85 * reach)
            camera.look_at = (x, y, 0.0)

    async def _keep_north_up(self, camera: CameraHandle) -> None:
        """Undo a turn by the arrow keys, which cannot be switched off."""
        own = self._views.get(camera.client.client_id)
        if own is None or own.three_d or abs(abs(float(camera.wxyz @ STRAIGHT_DOWN)) - 1.0) < 1e-6:
            return
        distance = float(np.linalg.norm(camera.position - camera.look_at))
        x, y = (float(value) for value in camera.look_at[:2])
        with camera.client.atomic():
            camera.up_direction = (0.0, 1.0, 0.0)
            camera.position = (x, y, distance)
            camera.look_at = (x, y, 0.0)


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


def _rotation_lock(client: ClientHandle) -> SceneNodeHandle:
    """Put a sheet under everything that takes left drags: the camera would turn by them, and north not stay up."""
    sheet = client.scene.add_box(
        LOCK,
        dimensions=(20_000.0, 20_000.0, 0.01),
        position=(0.0, 0.0, -1.0),
        opacity=0.0,
        cast_shadow=False,
        receive_shadow=False,
    )

    async def take(_event: object) -> None:
        pass

    sheet.on_drag("left")(take)
    return sheet
