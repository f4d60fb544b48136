"""Tags of the site: where each stands, which way it faces, and what is read on it."""

from __future__ import annotations

import numpy as np
from viser import LabelHandle, SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import NO_SEGMENTS, Points, stroke_segments
from commission.app.base.layer import BaseLayer, LayerGroup
from commission.app.base.marks import add_cased_lines
from commission.app.base.view import PageView
from commission.geometry import se2
from commission.site.project import Project
from commission.site.tags import Tag

HALF = 0.12
"""Half the side of the square of a tag [m]."""
ARROW = 0.35
"""Length of the arrow of its x axis [m]."""
LABEL_ASIDE = 0.18
"""From a tag to the corner of its name [m]: clear of its square, however that is turned."""
MOST_LABELS = 60
OUTLINE = np.array(
    [
        [(-HALF, -HALF), (HALF, -HALF)],
        [(HALF, -HALF), (HALF, HALF)],
        [(HALF, HALF), (-HALF, HALF)],
        [(-HALF, HALF), (-HALF, -HALF)],
        [(0.0, 0.0), (ARROW, 0.0)],
        [(ARROW, 0.0), (ARROW - 0.1, 0.07)],
        [(ARROW, 0.0), (ARROW - 0.1, -0.07)],
    ]
)
"""(S, 2, 2) strokes of a tag [m], its own frame."""


class TagLayer(BaseLayer):
    """All tags of the project."""

    name = "Tags"
    group = LayerGroup.SITE
    rank = 145
    reads: tuple[str, ...] = ("tags",)
    legend = (theme.Legend("tag: tells place and heading; the arrow is its x axis", theme.TAG, theme.Mark.SQUARE),)

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._outlines = add_cased_lines(scene, "/tags/outlines", theme.TAG, 2.0)
        self._labels: tuple[LabelHandle, ...] = ()

    def is_used(self, view: PageView) -> bool:
        """Whether the site has tags."""
        return bool(view.state.project.tags)

    def show_site(self, project: Project) -> None:
        """Draw every tag anew: there are few."""
        self._outlines.points = tag_strokes(project.tags)
        for label in self._labels:
            label.remove()
        self._labels = tuple(
            self.scene.add_label(
                f"/tags/names/{number}",
                "tag, no id" if tag.anonymous else f"tag {tag.id}",
                position=(tag.x + LABEL_ASIDE, tag.y - LABEL_ASIDE, theme.Height.LABEL),
                anchor="top-left",
                font_screen_scale=0.7,
            )
            for number, tag in enumerate(project.tags[:MOST_LABELS])
        )

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return outlines and names."""
        return *self._outlines.nodes, *self._labels


def tag_strokes(tags: tuple[Tag, ...], height: float = theme.Height.REFLECTOR) -> Points:
    """(N, 2, 3) strokes of tags: a square and an arrow each [m].

    Parameters
    ----------
    tags : of a site.
    height : at which they are drawn [m].
    """
    if not tags:
        return NO_SEGMENTS
    strokes = [se2.transform_points(tag.pose, OUTLINE.reshape(-1, 2)).reshape(-1, 2, 2) for tag in tags]
    return stroke_segments(np.concatenate(strokes), height)
