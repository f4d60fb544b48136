"""From clicks on the floor to the reflector whose failure is shown. It only posts."""

from __future__ import annotations

from viser import SceneApi, SceneClickEvent

from commission.app.base.panel import BasePanel, Post, from_browser
from commission.app.base.pointer import on_floor, reach_of
from commission.app.failures.actions import ClickReflector


class FailureClicks(BasePanel):
    """Posts each click of any browser on the floor; a panel without widgets.

    Parameters
    ----------
    scene : everybody's.
    post : takes the actions.
    """

    def __init__(self, scene: SceneApi, post: Post) -> None:
        def clicked(event: SceneClickEvent) -> None:
            place = on_floor(event.ray_origin, event.ray_direction)
            if place is not None:
                post(from_browser(ClickReflector(place, reach_of(event.client)), event.client_id))

        scene.on_click()(clicked)
