"""From clicks and drags in a browser to places on the floor: rays cut with z = 0, then one action each."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from viser import ClientHandle, SceneApi, SceneClickEvent, SceneNodeDragEvent

from commission.app.base.actions import Action, ClickFloor, DragFloor, Point
from commission.app.base.cameras import OnDrag
from commission.app.base.panel import BasePanel, Post, from_browser

REACH_SHARE = 0.016
"""How near to something a click has to be, as a share of the visible height: about 10 pixels."""


def on_floor(origin: tuple[float, float, float], direction: tuple[float, float, float]) -> Point | None:
    """Return where a ray meets the floor [m]; none when it points away from it."""
    if direction[2] * origin[2] >= 0.0:
        return None
    x, y, _ = np.asarray(origin) - np.asarray(direction) * (origin[2] / direction[2])
    return float(x), float(y)


def reach_of(client: ClientHandle) -> float:
    """Return how near to something a click has to be at the browser's zoom [m]."""
    camera = client.camera
    distance = float(np.linalg.norm(np.asarray(camera.position) - np.asarray(camera.look_at)))
    return REACH_SHARE * 2.0 * distance * float(np.tan(0.5 * camera.fov))


def take_clicks(client: ClientHandle, scene: SceneApi, post: Post) -> None:
    """Post each click of a browser on the floor.

    Parameters
    ----------
    client : the browser.
    scene : its own, in map coordinates.
    post : takes the actions.
    """

    def clicked(event: SceneClickEvent, *, add: bool) -> None:
        place = on_floor(event.ray_origin, event.ray_direction)
        if place is not None:
            post(from_browser(ClickFloor(place, reach_of(client), add), client.client_id))

    scene.on_click()(lambda event: clicked(event, add=False))
    scene.on_click(modifier="shift")(lambda event: clicked(event, add=True))


class FloorClicks(BasePanel):
    """Posts an action for each click of any browser on the floor; a panel without widgets.

    Parameters
    ----------
    scene : everybody's.
    post : takes the actions.
    action : makes one of the place [m], map frame, and of how near to something counts as on it [m].
    """

    def __init__(self, scene: SceneApi, post: Post, action: Callable[[Point, float], Action]) -> None:
        def clicked(event: SceneClickEvent) -> None:
            place = on_floor(event.ray_origin, event.ray_direction)
            if place is not None:
                post(from_browser(action(place, reach_of(event.client)), event.client_id))

        scene.on_click()(clicked)


def floor_drag(post: Post) -> OnDrag:
    """Return what takes the drags of the sheet under the floor.

    Its places lie on the sheet, 1 m below: in the plan, seen from far above, that shifts nothing.
    """

    async def dragged(event: SceneNodeDragEvent[Any]) -> None:
        start, now = (
            (float(position[0]), float(position[1])) for position in (event.start_position, event.end_position)
        )
        add = event.modifier == "shift"
        post(
            from_browser(
                DragFloor(phase=event.phase, start=start, now=now, reach=reach_of(event.client), add=add),
                event.client_id,
            )
        )

    return dragged
