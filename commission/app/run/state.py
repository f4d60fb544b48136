"""What the run is asked to do: the feature's part of the page's state."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.run.actions import Source
from commission.app.run.charts import SHOWN_FIRST
from commission.app.run.trail_colors import TrailBy

SPEEDS = (0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
"""Factors that the play clock offers."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunState:
    """Source and play clock."""

    source: Source | None = None
    """What drives."""
    live: bool = False
    """Whether it is a vehicle that drives now, and no source."""
    playing: bool = False
    """Whether the play clock runs."""
    speed: float = 1.0
    """Factor of the play clock against real time."""
    backward: bool = False
    """Whether it runs backward."""
    repeat: bool = False
    """Whether the drive starts again at its end."""
    trail_by: TrailBy = TrailBy.NOTHING
    """What the trail on the floor is colored by."""
    from_here_on: bool = False
    """Whether an edit acts from the cursor on, and not on the whole drive."""
    only_the_map: bool = False
    """Whether an edit of the site moves the map alone, and the hall of a virtual drive stays."""
    figure: str = ""
    """Key of the figure by which the reflectors on the floor are colored; empty: none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlotWindow:
    """What one browser's plots show."""

    span: tuple[float, float] | None = None
    """Begin and end of the stretch of time [s]; none: the whole drive."""
    titles: tuple[str, ...] = SHOWN_FIRST
    """Which plots, in the order of `CHARTS`."""
