"""Detections of the newest scan: inliers yellow, outliers red, with one shape for each of the two filters."""

from __future__ import annotations

from typing import Literal, TypeAlias

from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import NO_POINTS, lift
from commission.app.base.extent import extent_of
from commission.app.base.layer import BaseLayer
from commission.app.base.marks import add_points
from commission.app.base.view import PageView
from commission.app.run.view import RunView
from commission.localization.estimate import Status
from commission.site.project import Project

Shape: TypeAlias = Literal["circle", "square", "diamond"]

STYLES: dict[Status, tuple[theme.Color, Shape, str]] = {
    Status.INLIER: (theme.INLIER, "circle", "inlier"),
    Status.OUTLIER_ASSOCIATION: (theme.OUTLIER_ASSOCIATION, "square", "outlier: outside every gate"),
    Status.OUTLIER_DETECTOR: (theme.OUTLIER_DETECTOR, "diamond", "outlier: too few or many beams"),
}
MARKS: dict[Shape, theme.Mark] = {"circle": theme.Mark.DOT, "square": theme.Mark.SQUARE, "diamond": theme.Mark.DIAMOND}


class DetectionLayer(BaseLayer):
    """Detections of the newest scan."""

    name = "Detections"
    rank = 170
    legend = tuple(theme.Legend(text, color, MARKS[shape]) for color, shape, text in STYLES.values())

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._clouds = {
            status: add_points(scene, f"/run/detections/{status.name.lower()}", color, 0.08, shape=shape)
            for status, (color, shape, _) in STYLES.items()
        }

    def show_site(self, project: Project) -> None:
        """Adapt the size of marks to the site's."""
        for cloud in self._clouds.values():
            cloud.point_size = 0.9 * extent_of(project).mark_size()

    def draw(self, view: PageView) -> None:
        """Draw every detection where it is seen from the estimated pose."""
        run = view.part(RunView)
        if run is None:
            return
        for status, cloud in self._clouds.items():
            chosen = NO_POINTS
            if run.estimate is not None:
                of_status = run.estimate.points_map[run.estimate.status == status]
                chosen = lift(of_status, theme.Height.DETECTION)
            if len(chosen) or len(cloud.points):
                cloud.points = chosen

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the marks of every status."""
        return tuple(self._clouds.values())
