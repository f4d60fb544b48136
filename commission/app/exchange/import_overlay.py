"""Where an import would put things, drawn on the floor of the browser that looks at it. Nothing has changed yet."""

from __future__ import annotations

import numpy as np
from viser import SceneApi

from commission.app.base import theme
from commission.app.base.drawing import NO_SEGMENTS, outline_segments, polyline_segments, rings
from commission.app.base.extent import extent_of
from commission.app.base.marks import add_cased_lines
from commission.app.base.panel import BasePanel
from commission.app.base.view import PageView
from commission.app.exchange.outlines import outlines_of
from commission.app.exchange.pending import Exchange, Pending
from commission.site.project import Project


class ImportOverlay(BasePanel):
    """Rings and lines; a panel without widgets.

    Parameters
    ----------
    scene : the browser's own.
    browser : number of its connection.
    """

    def __init__(self, scene: SceneApi, browser: int) -> None:
        self._browser = browser
        self._lines = add_cased_lines(scene, "/exchange/import", theme.PREVIEW, 1.5)
        self._shown: tuple[Pending | None, Project | None] = (None, None)

    def draw(self, view: PageView) -> None:
        """Draw what waits for a yes or no, compared with the project as it is."""
        pending = view.state.of_browser(self._browser, Exchange).pending
        compared = None if pending is None else view.state.project
        if self._shown[0] is pending and self._shown[1] is compared:
            return
        self._shown = pending, compared
        found = outlines_of(view.state.project, pending)
        size, height = 0.9 * extent_of(view.state.project).mark_size(), theme.Height.EDITING
        lines = [outline_segments(rings(found.centers, size), height)] if len(found.centers) else []
        lines += [polyline_segments(line, height) for line in found.lines]
        self._lines.points = np.concatenate(lines) if lines else NO_SEGMENTS
