"""Where the vehicle has been: as estimated, and as the reference says."""

from __future__ import annotations

import numpy as np
from viser import SceneApi, SceneNodeHandle

from commission.app.base import theme
from commission.app.base.drawing import polyline_segments, thinned
from commission.app.base.layer import BaseLayer
from commission.app.base.marks import add_lines
from commission.app.base.view import PageView
from commission.app.run.view import RunView

MOST_POINTS = 800


class TrailLayer(BaseLayer):
    """Trail of the estimate."""

    name = "Trail"
    rank = 210
    legend = (theme.Legend("trail of the estimate", theme.TRAIL, theme.Mark.LINE),)

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._line = add_lines(scene, "/run/trail", theme.TRAIL, 1.5)

    def draw_slowly(self, view: PageView) -> None:
        """Draw the whole trail."""
        run = view.part(RunView)
        if run is None:
            return
        self._line.points = polyline_segments(
            thinned(run.result.columns.means[: run.lived, :2], MOST_POINTS), theme.Height.TRAIL
        )

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the line."""
        return (self._line,)


class ReferenceLayer(BaseLayer):
    """Trail of the reference."""

    name = "Reference"
    rank = 220
    legend = (theme.Legend("reference (truth)", theme.REFERENCE, theme.Mark.LINE),)

    def __init__(self, scene: SceneApi) -> None:
        super().__init__(scene)
        self._line = add_lines(scene, "/run/reference", theme.REFERENCE, 3.0)

    def draw_slowly(self, view: PageView) -> None:
        """Draw the reference positions up to now."""
        run = view.part(RunView)
        if run is None:
            return
        lived = run.result.references[: run.lived, :2]
        known = lived[np.isfinite(lived[:, 0])]
        self._line.points = polyline_segments(thinned(known, MOST_POINTS), theme.Height.REFERENCE)

    def nodes(self) -> tuple[SceneNodeHandle, ...]:
        """Return the line."""
        return (self._line,)
