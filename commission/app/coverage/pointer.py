"""From clicks on the floor to values read there. It only posts."""

from __future__ import annotations

from viser import SceneClickEvent, ViserServer

from commission.app.base.panel import Post
from commission.app.editing.pointer import on_floor, reach_of
from commission.app.plan.actions import ReadFloor


def read_clicks(server: ViserServer, post: Post) -> None:
    """Post each click of any browser on the floor."""

    def clicked(event: SceneClickEvent) -> None:
        place = on_floor(event.ray_origin, event.ray_direction)
        if place is not None:
            post(ReadFloor(place, reach_of(event.client), event.client_id))

    server.scene.on_click()(clicked)
