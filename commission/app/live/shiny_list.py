"""The list of shiny things beside the raw scan, and the mark on the floor of what was clicked in either. No study."""

from __future__ import annotations

import math

import numpy as np
from viser import SceneApi

from commission.app.base import theme
from commission.app.base.drawing import NO_SEGMENTS, outline_segments, rings
from commission.app.base.extent import extent_of
from commission.app.base.marks import add_lines
from commission.app.base.panel import BasePanel, escaped
from commission.app.base.view import PageView
from commission.app.live.shiny_service import ShinyView
from commission.app.live.state import SensorWatch
from commission.site.quantity import PERCENT, number_text
from commission.studies.shiny import FEWEST, ShinyThing

MOST = 60
"""Things that are listed; they are in the order of how often they were seen."""
SAME_M = 0.4
"""Distance up to which what is seen at a marked place is what was marked [m]."""
RING_MARKS = 2.6
"""Radius of the mark on the floor, in sizes of a mark."""
COLUMNS = (
    ("x, y [m]", "Where it stands, map frame"),
    ("Scans", "How often it was seen while the vehicle knew its pose"),
    ("Range [m]", "Distances that it was seen from"),
    ("Peak / threshold", "Median of its largest intensity, and from where on a beam is reflective [sensor's unit]"),
    ("Passes [%]", "Share of its sightings whose beams pass as a reflector's: only the map told them from one"),
    ("Beside", "The reflector that it stands beside"),
)


def list_text(found: ShinyView | None, marked: tuple[float, float] | None, *, is_live: bool, inbox: str) -> str:
    """Return the list as html.

    Parameters
    ----------
    found : what there is; none: nothing was looked for.
    marked : the place that was clicked [m], map frame; none: none was.
    is_live : whether a vehicle drives now: then the list is of what has come so far, and comes when it is asked for.
    inbox : identifier of the text field that the page's script writes clicks into.
    """
    again = f"<button class='c-s-find' data-inbox='{inbox}'>Look now</button>" if is_live else ""
    things = None if found is None else found.things
    if things is None:
        note = _none_yet(found, is_live=is_live)
        return _framed(f"<b>Shiny things</b>{again}", f"<div class='c-note'>{note}</div>")
    of = f" of the first {found.seconds:.0f} s" if found is not None and is_live else ""
    outdated = "; of the run before" if found is not None and found.outdated else ""
    more = f", the first {MOST} listed" if len(things) > MOST else ""
    head = f"<b>Shiny things</b> {len(things)}{of}{more}{outdated}{again}"
    if not things:
        note = f"Nothing but reflectors of the map was as bright as one, in {FEWEST} scans or more."
        return _framed(head, f"<div class='c-note'>{note}</div>")
    titles = "".join(f"<th title='{escaped(hint)}'>{escaped(title)}</th>" for title, hint in COLUMNS)
    rows = "".join(_row(each, marked) for each in things[:MOST])
    return _framed(
        head,
        f"<table data-inbox='{inbox}'><thead><tr>{titles}</tr></thead><tbody>{rows}</tbody></table>",
    )


def _none_yet(found: ShinyView | None, *, is_live: bool) -> str:
    """Say why there is no list."""
    if is_live:
        return "A vehicle drives now. Look now lists what was as bright as a reflector so far and is none of the map."
    if found is None:
        return "Listed when a drive is there."
    return "Looking for them …" if found.outdated else "The search failed; another run starts it again."


def _framed(head: str, content: str) -> str:
    return (
        f"<div class='c-s-list'><div class='c-s-list-head'>{head}</div><div class='c-s-list-body'>{content}</div></div>"
    )


def _row(thing: ShinyThing, marked: tuple[float, float] | None) -> str:
    is_marked = marked is not None and math.dist(marked, (thing.x, thing.y)) <= SAME_M
    bright = (
        "flagged" if math.isnan(thing.intensity) else f"{number_text(thing.intensity)} / {number_text(thing.threshold)}"
    )
    cells = (
        f"{thing.x:.2f}, {thing.y:.2f}",
        str(thing.scans),
        f"{thing.nearest:.1f}–{thing.farthest:.1f}",
        bright,
        PERCENT.number(thing.passed, ".0f"),
        escaped(thing.beside),
    )
    told = "".join(f"<td>{cell}</td>" for cell in cells)
    at = f"data-at='{thing.x:.4f},{thing.y:.4f}'"
    return (
        f"<tr tabindex='0' {at}{' aria-selected=true' if is_marked else ''} title='{escaped(thing.text)}'>{told}</tr>"
    )


class SeenMark(BasePanel):
    """A ring around what was clicked, in the browser that looks at the scan; a panel without widgets.

    Parameters
    ----------
    scene : the browser's own.
    browser : number of its connection.
    """

    def __init__(self, scene: SceneApi, browser: int) -> None:
        self._browser = browser
        self._lines = add_lines(scene, "/live/seen_mark", theme.SELECTED, 2.5)
        self._shown: tuple[float, float] | None = None

    def draw(self, view: PageView) -> None:
        """Draw it while the raw-sensor view is there to say what it is."""
        watch = view.state.of_browser(self._browser, SensorWatch)
        marked = watch.marked if watch.seen else None
        if marked == self._shown:
            return
        self._shown = marked
        size = RING_MARKS * extent_of(view.state.project).mark_size()
        self._lines.points = (
            NO_SEGMENTS if marked is None else outline_segments(rings(np.array([marked]), size), theme.Height.EDITING)
        )
