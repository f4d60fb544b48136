"""An image that is being placed: what of it would become walls, and the two points that were clicked on it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import lift, polyline_segments
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_lines, add_points
from commission.app.base.paints import Floor
from commission.app.base.view import PageView
from commission.app.floor_map.draft import MapDraft, MapLoading
from commission.io.image_map import Picture

LONGEST_SIDE = 1600
"""Pixels of the picture that is drawn: a larger one is thinned, so that the threshold's slider stays quick."""
PAPER = Floor.DRAFT_PAPER.dark
INK = Floor.DRAFT_INK.dark


def preview(picture: Picture, threshold: float, *, light_walls: bool) -> NDArray[np.uint8]:
    """Return the (H, W, 3) picture of what would become walls, lowest row first as viser draws it.

    Parameters
    ----------
    picture : the image that was opened.
    threshold : brightness that parts walls from floor [0..1].
    light_walls : whether walls are light on dark.
    """
    walls = picture.walls(threshold, light_walls=light_walls)
    step = -(-max(walls.shape) // LONGEST_SIDE)
    walls = walls[::step, ::step][::-1]
    return np.where(walls[..., np.newaxis], np.array(INK, np.uint8), np.array(PAPER, np.uint8))


class MapDraftLayer(BaseLayer):
    """The image, in everybody's scene, over all else: one clicks on it."""

    name = "Image being placed"
    group = LayerGroup.MAP
    rank = 240
    reads: tuple[str, ...] = ()

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._nodes: tuple[SceneNodeHandle, ...] = ()
        self._drawn: tuple[object, ...] = ()
        self._marked: tuple[SceneNodeHandle, ...] = ()
        self._shown: MapDraft | None = None

    def draw(self, view: PageView) -> None:
        """Follow the draft."""
        state = view.state
        draft = state.part(MapLoading).draft
        if draft is self._shown:
            return
        self._shown = draft
        picture = None if draft is None else draft.read
        drawn = (picture, draft.options.threshold, draft.options.light_walls) if draft is not None else ()
        if not isinstance(picture, Picture):
            drawn = ()
        if len(drawn) != len(self._drawn) or any(
            a is not b and a != b for a, b in zip(drawn, self._drawn, strict=True)
        ):
            self._drawn = drawn
            self._draw_picture(draft)
        self._draw_points(draft)

    def is_used(self, view: PageView) -> bool:
        """Whether there is one."""
        return view.state.part(MapLoading).draft is not None

    def _draw_picture(self, draft: MapDraft | None) -> None:
        for node in self._nodes:
            node.remove()
        self._nodes = ()
        if draft is None or not isinstance(draft.read, Picture):
            return
        width, height = (side * draft.stage.pixel for side in draft.read.size)
        center = draft.stage.left + 0.5 * width, draft.stage.top - 0.5 * height
        self._nodes = (
            self.scene.add_image(
                "/draft/image",
                preview(draft.read, draft.options.threshold, light_walls=draft.options.light_walls),
                render_width=width,
                render_height=height,
                format="png",
                position=(*center, theme.Height.DRAFT),
                cast_shadow=False,
                receive_shadow=False,
            ),
        )

    def _draw_points(self, draft: MapDraft | None) -> None:
        for node in self._marked:
            node.remove()
        self._marked = ()
        if draft is None or not draft.pixels:
            return
        places = np.array([draft.stage.place_of(pixel) for pixel in draft.pixels])
        height = theme.Height.EDITING
        size = 0.008 * max(draft.read.size) * draft.stage.pixel if isinstance(draft.read, Picture) else 0.1
        self._marked = (
            add_points(self.scene, "/draft/points", theme.SELECTED, size, points=lift(places, height)),
            add_lines(self.scene, "/draft/line", theme.SELECTED, 2.0, lines=polyline_segments(places, height)),
            *(
                self.scene.add_label(f"/draft/{name}", name, position=(float(x), float(y), height))
                for name, (x, y) in zip("AB", places, strict=False)
            ),
        )

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the picture and its points."""
        return (*self._nodes, *self._marked)
