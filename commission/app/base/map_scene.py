"""viser's scene in map coordinates: the one place that converts between the map frame and what browsers draw.

A browser draws with float32, which at the 5.7e6 m of a national grid has steps of half a metre. So a site far from the
map's zero is drawn relative to an origin of its own. Layers, cameras and pointer know nothing of that: they write and
read map coordinates. What hangs on a placed node (the vehicle's outline on its frame) is in that node's frame.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast
from weakref import WeakSet

import numpy as np
from numpy.typing import NDArray
from viser import CameraHandle, ClientHandle, SceneApi

from commission.app.base import viser_private
from commission.app.base.extent import Extent
from commission.geometry.arrays import FloatArray

NEAR = 2000.0
"""Distance from the scene's origin up to which a site is drawn where it is: float32 has steps of 0.1 mm there [m]."""
ROUNDED_TO = 100.0
"""An origin is a whole multiple of this [m]."""

WHERE = {
    "add_line_segments": "points",
    "add_point_cloud": "points",
    "add_batched_meshes_simple": "batched_positions",
    "add_label": "position",
    "add_image": "position",
    "add_frame": "position",
    "add_transform_controls": "position",
    "add_mesh_simple": "position",
}
"""What each way to add a node says where it is; one that is not named here cannot be used."""
PASSED_ON = frozenset({"add_light_ambient", "add_light_directional", "configure_environment_map"})


def origin_for(extent: Extent, before: tuple[float, float]) -> tuple[float, float]:
    """Return the scene's origin in the map frame [m]: the one before while the site is near to it.

    Parameters
    ----------
    extent : of the site.
    before : where it has been so far [m].
    """
    farthest = max(
        abs(value - at) for corner in (extent.low, extent.high) for value, at in zip(corner, before, strict=True)
    )
    if farthest <= NEAR:
        return before
    x, y = (round(value / ROUNDED_TO) * ROUNDED_TO for value in extent.center)
    return (0.0, 0.0) if np.hypot(x, y) <= NEAR else (x, y)


class SceneOrigin:
    """Where the scene's zero lies in the map frame, and every node that has to move when it does."""

    def __init__(self) -> None:
        self._offset = np.zeros(3)
        self._nodes: WeakSet[MapNode] = WeakSet()
        self._frames: set[str] = set()

    @property
    def place(self) -> tuple[float, float]:
        """Where it lies [m], map frame."""
        return float(self._offset[0]), float(self._offset[1])

    def move(self, place: tuple[float, float]) -> None:
        """Put the scene's zero elsewhere, and draw everything that is there relative to it."""
        self._offset = np.array([*place, 0.0])
        for node in tuple(self._nodes):
            node.place_again()

    def to_scene(self, points: Any) -> FloatArray:
        """Return (..., 3) points of the map frame [m] in the scene's frame."""
        return np.asarray(points, np.float64) - self._offset

    def to_map(self, points: Any) -> FloatArray:
        """Return (..., 3) points of the scene's frame [m] in the map frame."""
        return np.asarray(points, np.float64) + self._offset

    def scene(self, scene: SceneApi) -> SceneApi:
        """Return a scene, everybody's or one browser's own, that takes and gives map coordinates."""
        return cast("SceneApi", MapScene(scene, self))

    def camera(self, client: ClientHandle) -> CameraHandle:
        """Return a browser's camera with its places in the map frame."""
        return cast("CameraHandle", MapCamera(client.camera, self))

    def has_placed_ancestor(self, name: str) -> bool:
        """Whether a node hangs on one that has a place of its own."""
        parts = name.split("/")
        return any("/".join(parts[:end]) in self._frames for end in range(2, len(parts)))

    def watch(self, node: MapNode, name: str) -> None:
        """Move a node with the origin from now on."""
        self._nodes.add(node)
        if node.where == "position":
            self._frames.add(name)

    def forget(self, node: MapNode, name: str) -> None:
        """Leave a node alone from now on."""
        self._nodes.discard(node)
        self._frames.discard(name)


class MapNode:
    """A node of the scene whose places are in the map frame.

    Parameters
    ----------
    handle : viser's.
    origin : of the scene.
    where : the property that says where the node is.
    place : its value [m], map frame.
    """

    __slots__ = ("__weakref__", "_handle", "_origin", "_place", "where")

    def __init__(self, handle: Any, origin: SceneOrigin, where: str, place: Any) -> None:
        for name, value in (("_handle", handle), ("_origin", origin), ("where", where), ("_place", place)):
            object.__setattr__(self, name, value)
        origin.watch(self, handle.name)

    def __getattr__(self, name: str) -> Any:
        """Return a property; a place in the map frame."""
        value = getattr(self._handle, name)
        if name == self.where:
            return self._place if name != "position" else tuple(self._origin.to_map(value))
        return value

    def __setattr__(self, name: str, value: Any) -> None:
        """Set a property; a place in the map frame."""
        if name == self.where:
            object.__setattr__(self, "_place", value)
            self.place_again()
        else:
            setattr(self._handle, name, value)

    def place_again(self) -> None:
        """Draw the node relative to where the origin is now."""
        place = _for_viser(self.where, self._origin.to_scene(self._place))
        if isinstance(place, tuple):
            viser_private.write_position(self._handle, place)
        else:
            viser_private.write_array(self._handle, self.where, place)

    def remove(self) -> None:
        """Take the node out of the scene."""
        self._origin.forget(self, self._handle.name)
        self._handle.remove()

    def on_drag(self, *arguments: Any, **options: Any) -> Callable[[Callable[[Any], Any]], Any]:
        """Register what is called with drags of the node, their places in the map frame."""
        register = self._handle.on_drag(*arguments, **options)

        def registered(callback: Callable[[Any], Any]) -> Any:
            async def called(event: Any) -> None:
                start, end = (tuple(self._origin.to_map(at)) for at in (event.start_position, event.end_position))
                await callback(replace(event, start_position=start, end_position=end))

            register(called)
            return callback

        return registered


class MapScene:
    """What layers and panels use of a scene, in map coordinates; anything else is refused rather than drawn elsewhere.

    Parameters
    ----------
    scene : viser's.
    origin : of the scene.
    """

    def __init__(self, scene: SceneApi, origin: SceneOrigin) -> None:
        self._scene, self._origin = scene, origin

    def __getattr__(self, name: str) -> Any:
        """Return a way to add a node."""
        if name in PASSED_ON:
            return getattr(self._scene, name)
        where = WHERE.get(name)
        if where is None:
            raise AttributeError(f"scene.{name} is not in map coordinates; expected one of {', '.join(WHERE)}")
        return lambda *arguments, **options: self._add(name, where, arguments, options)

    def _add(self, add: str, where: str, arguments: tuple[Any, ...], options: dict[str, Any]) -> Any:
        """Add a node, which says by name where it is; one that hangs on a placed node stays in that node's frame."""
        make = getattr(self._scene, add)
        name = options.get("name", arguments[0] if arguments else "")
        if self._origin.has_placed_ancestor(name):
            return make(*arguments, **options)
        where = "position" if "position" in options else where
        place = options.get(where, (0.0, 0.0, 0.0))
        options = {**options, where: _for_viser(where, self._origin.to_scene(place))}
        return MapNode(make(*arguments, **options), self._origin, where, place)

    def on_click(self, **options: Any) -> Callable[[Callable[[Any], None]], Any]:
        """Register what is called with clicks on the scene, their rays in the map frame."""
        register = self._scene.on_click(**options)

        def registered(callback: Callable[[Any], None]) -> Any:
            register(lambda event: callback(replace(event, ray_origin=tuple(self._origin.to_map(event.ray_origin)))))
            return callback

        return registered


class MapCamera:
    """A browser's camera with `position` and `look_at` in the map frame.

    Parameters
    ----------
    camera : viser's.
    origin : of the scene.
    """

    __slots__ = ("_camera", "_origin")

    def __init__(self, camera: CameraHandle, origin: SceneOrigin) -> None:
        object.__setattr__(self, "_camera", camera)
        object.__setattr__(self, "_origin", origin)

    def __getattr__(self, name: str) -> Any:
        """Return a property; a place in the map frame."""
        value = getattr(self._camera, name)
        return self._origin.to_map(value) if name in ("position", "look_at") else value

    def __setattr__(self, name: str, value: Any) -> None:
        """Set a property; a place in the map frame."""
        setattr(self._camera, name, self._origin.to_scene(value) if name in ("position", "look_at") else value)


def set_points(node: Any, points: FloatArray) -> None:
    """Move the points of lines or marks, whether they are in the map frame or hang on a placed node.

    Parameters
    ----------
    node : a handle of such a scene.
    points : (N, 3) or (N, 2, 3) [m], in the frame that the node is in.
    """
    if isinstance(node, MapNode):
        node.points = points
    else:
        viser_private.write_array(node, "points", points.astype(np.float32))


def _for_viser(where: str, place: FloatArray) -> tuple[float, ...] | NDArray[np.float32]:
    """Return a place in the type that viser takes there."""
    return tuple(map(float, place)) if where == "position" else place.astype(np.float32)
