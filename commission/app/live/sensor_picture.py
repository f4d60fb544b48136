"""The raw scan as a picture: intensity over bearing with the threshold, and beams of clusters over range. No widget.

Curves are drawn in a square of SIDE that is stretched to the room there is; words are laid over it in percent.
"""

from __future__ import annotations

import math

import numpy as np

from commission.app.base import theme
from commission.app.base.panel import escaped
from commission.app.live.shiny_list import SAME_M
from commission.geometry.arrays import FloatArray
from commission.localization.estimate import Status
from commission.site.quantity import DEGREES, PERCENT, counted_text, number_text
from commission.studies.sensor_view import SeenCluster, SensorView

SIDE = 1000.0
"""Side of the pictures before they are stretched."""
FLAGS_TOP = 2.0
"""Upper edge where sensors flag reflectors: a flag is 1, and what is written above has its room."""
FILLED = 0.92
"""Share of the height up to which what is largest reaches."""
NICE = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
"""Ends of an axis, times a power of ten: it does not breathe with every scan."""
STEPS_DEG = (10.0, 15.0, 30.0, 45.0, 60.0, 90.0)
MOST_STEPS = 10
BELOW_A_NUMBER = 0.15
"""Share of the height that a number of the scale takes, below its place: 13 of the 90 pixels of the lowest plot."""
NAME_PERCENT = 4.0
"""Names of reflectors are at least so far from each other [% of the width]."""
COLORS = {
    Status.INLIER: theme.css(theme.INLIER),
    Status.OUTLIER_DETECTOR: theme.css(theme.OUTLIER_DETECTOR),
    Status.OUTLIER_ASSOCIATION: theme.css(theme.OUTLIER_ASSOCIATION),
}
WORDS = {
    Status.INLIER: "accepted",
    Status.OUTLIER_DETECTOR: "rejected by beams",
    Status.OUTLIER_ASSOCIATION: "rejected by gate",
}


def upper_end(largest: float) -> float:
    """Return the upper end of an axis on which a number has its place."""
    if not (math.isfinite(largest) and largest > 0.0):
        return 1.0
    wanted = largest / FILLED
    power = 10.0 ** math.floor(math.log10(wanted))
    return next((nice * power for nice in NICE if nice * power >= wanted), 10.0 * power)


def head(view: SensorView, threshold: float) -> str:
    """Return what is seen in words."""
    counts = {status: sum(each.status is status for each in view.clusters) for status in WORDS}
    told = [f"{count} {WORDS[status]}" for status, count in counts.items() if count]
    beams = f"{int(view.reflective.sum())} of {len(view.reflective)} beams"
    what = (
        f"{beams} at or above {number_text(threshold, 6)}" if view.has_intensities else f"{beams} flagged by the sensor"
    )
    clusters = counted_text(len(view.clusters), "cluster")
    return (
        f"<div class='c-s-head'><b>{escaped(view.name)}</b> {view.time:.2f} s: {what}; {clusters}"
        f"{': ' if told else ''}{', '.join(told)}</div>"
    )


def intensity_picture(view: SensorView, threshold: float, inbox: str, marked: tuple[float, float] | None = None) -> str:
    """Return intensity over bearing with the threshold as a line that can be dragged, as html.

    Parameters
    ----------
    view : the scan.
    threshold : the one near by [sensor's unit].
    inbox : identifier of the text field that the page's script writes a dragged threshold into.
    marked : place of what was clicked [m], map frame; none: nothing was.
    """
    scan = view.scan
    if scan.intensities is None and scan.reflector is None:
        return (
            f"<div class='c-s-plot c-s-none'>{escaped(view.name)} gives neither intensities nor flags: "
            "nothing tells a reflector from a wall</div>"
        )
    values = _strengths(view)
    bearings = DEGREES.of(scan.bearings)
    low, high = float(bearings.min()), float(bearings.max())
    flags = scan.intensities is None
    top = (
        FLAGS_TOP
        if flags
        else upper_end(max(float(values.max(initial=0.0)), threshold if view.has_intensities else 1.0))
    )
    x = SIDE * (bearings - low) / max(high - low, 1e-9)
    y, limits = SIDE * (1.0 - height(values, top)), SIDE * (1.0 - height(view.thresholds, top))
    lit = view.reflective
    curve = (
        f"<path class='c-s-curve' d='{_stems(x[~lit], y[~lit])}'/><path class='c-s-lit' d='{_stems(x[lit], y[lit])}'/>"
    )
    far = "" if np.ptp(limits) < 1e-9 or not view.has_intensities else f"<path class='c-s-far' d='{_dots(x, limits)}'/>"
    chosen = marked_cluster(view, marked)
    marks = "".join(_mark(view, each, (low, high, top), is_chosen=each is chosen) for each in view.clusters)
    grid = "".join(
        f"<path class='c-s-grid' d='M{SIDE * (at - low) / (high - low):.1f} 0V{SIDE:g}'/>" for at in steps(low, high)
    )
    line = PERCENT.of(1.0 - float(height(np.array(threshold), top)))
    handle = (
        f"<i class='c-s-line' style='--c-at:{line:.3f}%' title='Drag: intensity from which a beam is reflective'>"
        f"<b>{number_text(threshold, 4)}</b></i>"
        if view.has_intensities
        else ""
    )
    scale = "" if flags else _scale(top, threshold if view.has_intensities else math.nan)
    words = "".join(
        f"<span class='c-s-x' style='left:{PERCENT.of((at - low) / (high - low)):.2f}%'>{at:g}°</span>"
        for at in steps(low, high)
    )
    return (
        f"<div class='c-s-plot c-s-intensity' data-top='{top:.6g}' data-inbox='{inbox}'>"
        f"<svg viewBox='0 0 {SIDE:g} {SIDE:g}' preserveAspectRatio='none'>{grid}{curve}{far}{marks}</svg>"
        f"{_names(view, low, high)}{words}{scale}{handle}"
        f"{_title(view) if chosen is None else _chosen_title(chosen)}</div>"
    )


def marked_cluster(view: SensorView, marked: tuple[float, float] | None) -> SeenCluster | None:
    """Return the cluster at a marked place [m], map frame; None where the scan has none there."""
    near = [each for each in view.clusters if marked is not None and math.dist(each.place, marked) <= SAME_M]
    return min(near, key=lambda each: math.dist(each.place, marked or each.place), default=None)


def height(values: FloatArray, top: float) -> FloatArray:
    """Share of the picture's height at which intensities are: by their roots, since near echoes dwarf far ones.

    Parameters
    ----------
    values : any shape [sensor's unit].
    top : the one at the upper edge.
    """
    return np.sqrt(np.clip(values / top, 0.0, 1.0))


def _scale(top: float, threshold: float) -> str:
    """The numbers at the upper edge, at half and at a quarter of the height, but none under the threshold's line."""
    line = float(height(np.array(threshold), top))
    shares = [share for share in (1.0, 0.5, 0.25) if not share - BELOW_A_NUMBER < line < share]
    return "".join(
        f"<span class='c-s-y' style='top:{PERCENT.of(1.0 - share):g}%'>{number_text(top * share * share)}</span>"
        for share in shares
    )


def _strengths(view: SensorView) -> FloatArray:
    """(B,) what is drawn of each beam: its intensity; of a sensor that gives none, 1 where it flags a reflector."""
    told = view.scan.intensities
    return np.nan_to_num(np.asarray(view.reflective if told is None else told, dtype=np.float64))


def _title(view: SensorView) -> str:
    text = "intensity over bearing [sensor's unit]"
    if view.scan.intensities is None:
        text = "reflector flag over bearing: the sensor decides, there is no threshold"
    elif view.scan.reflector is not None:
        text = "intensity over bearing: the sensor flags reflectors (bright), there is no threshold"
    return f"<span class='c-s-title'>{text}</span>"


def _chosen_title(each: SeenCluster) -> str:
    return f"<span class='c-s-title c-s-said'>marked: {escaped(told(each))}</span>"


def steps(low: float, high: float) -> list[float]:
    """Bearings at which a line of the grid is [deg]."""
    step = next((each for each in STEPS_DEG if (high - low) / each <= MOST_STEPS), STEPS_DEG[-1])
    first = math.ceil((low + 0.02 * (high - low)) / step)
    last = math.floor((high - 0.02 * (high - low)) / step)
    return [number * step for number in range(first, last + 1)]


def _stems(x: FloatArray, y: FloatArray) -> str:
    """A line from the ground to each value."""
    return "".join(f"M{at:.1f} {SIDE:g}V{to:.0f}" for at, to in zip(x.tolist(), y.tolist(), strict=True) if to < SIDE)


def _dots(x: FloatArray, y: FloatArray) -> str:
    return "".join(f"M{at:.1f} {to:.0f}h0" for at, to in zip(x.tolist(), y.tolist(), strict=True))


def _mark(view: SensorView, each: SeenCluster, axes: tuple[float, float, float], *, is_chosen: bool) -> str:
    """A dot over the strongest beam of a cluster, in the color of what became of it; `axes`: bearings [deg], top."""
    low, high, top = axes
    peak = 1.0 if view.scan.intensities is None else each.peak
    if math.isnan(peak):
        return ""
    x = SIDE * (DEGREES.of(each.bearing) - low) / (high - low)
    y = max(SIDE * (1.0 - float(height(np.array(peak), top))) - 40.0, 20.0)
    return _dot(each, (x, y), is_chosen=is_chosen)


def _dot(each: SeenCluster, at: tuple[float, float], *, is_chosen: bool) -> str:
    """What stands for a cluster in either plot: pointed at it says what it is, clicked it is marked."""
    place = f"M{at[0]:.1f} {at[1]:.0f}h0"
    halo = f"<path class='c-s-chosen' d='{place}'/>" if is_chosen else ""
    x, y = each.place
    return (
        f"{halo}<path class='c-s-mark' stroke='{COLORS[each.status]}' d='{place}' data-at='{x:.4f},{y:.4f}' "
        f"data-reflector='{escaped(each.reflector)}'><title>{escaped(told(each))}</title></path>"
    )


def told(each: SeenCluster) -> str:
    """Return a cluster in words."""
    window = "" if each.window is None else f" ({each.window[0]} to {each.window[1]} pass)"
    who = f", {each.reflector}" if each.reflector else ""
    peak = "" if math.isnan(each.peak) else f", peak {number_text(each.peak, 4)}"
    where = f"{DEGREES.text(each.bearing, '.1f')}, {each.range:.2f} m"
    return f"{where}, {counted_text(each.beams, 'beam')}{window}{peak}: {WORDS[each.status]}{who}"


def _names(view: SensorView, low: float, high: float) -> str:
    """Reflectors of the map at the bearings where they should be."""
    written: dict[str, float] = {}
    for name, _, bearing in sorted(view.expected, key=lambda each: each[1]):
        at = PERCENT.of((float(DEGREES.of(bearing)) - low) / (high - low))
        # Of reflectors in one direction the nearest has its name.
        if 0.0 <= at <= 100.0 and all(abs(at - other) > NAME_PERCENT for other in written.values()):
            written[name] = at
    return "".join(
        f"<span class='c-s-name' style='left:{at:.2f}%'>{escaped(name)}</span>" for name, at in written.items()
    )


def beams_picture(view: SensorView, inbox: str = "", marked: tuple[float, float] | None = None) -> str:
    """Return beams of clusters over range against those that pass (Sobreira et al. 2016, Fig. 6), as html.

    Parameters
    ----------
    view : the scan.
    inbox : identifier of the text field that the page's script writes clicks into.
    marked : place of what was clicked [m], map frame; none: nothing was.
    """
    seen = view.widths
    reach = upper_end(max([float(seen[:, 0].max(initial=0.0)), 1.0]) * FILLED)
    most = upper_end(max(float(np.quantile(seen[:, 1], 0.99)) if len(seen) else 0.0, 8.0))

    def place(ranges: FloatArray, beams: FloatArray) -> tuple[FloatArray, FloatArray]:
        return SIDE * ranges / reach, SIDE * (1.0 - np.minimum(beams / most, 1.0))

    window = view.window[view.window[:, 0] <= reach]
    band = ""
    if len(window):
        (x, fewest), (_, largest) = (place(window[:, 0], window[:, column]) for column in (1, 2))
        edges = [*zip(x, fewest, strict=True), *list(zip(x, largest, strict=True))[::-1]]
        band = "<path class='c-s-band' d='M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in edges) + "Z'/>"
    dots = ""
    for passed, color in ((1.0, "c-s-passed"), (0.0, "c-s-failed")):
        of = seen[seen[:, 2] == passed]
        dots += f"<path class='{color}' d='{_dots(*place(of[:, 0], of[:, 1]))}'/>"
    chosen = marked_cluster(view, marked)
    now = "".join(
        _dot(
            each,
            (SIDE * each.range / reach, SIDE * (1.0 - min(each.beams / most, 1.0))),
            is_chosen=each is chosen,
        )
        for each in view.clusters
        if each.beams
    )
    return (
        f"<div class='c-s-plot c-s-beams' data-inbox='{inbox}'>"
        f"<svg viewBox='0 0 {SIDE:g} {SIDE:g}' preserveAspectRatio='none'>"
        f"{band}{dots}{now}</svg><span class='c-s-top'>{most:g} beams</span><span class='c-s-x' style='left:50%'>"
        f"{0.5 * reach:g} m</span><span class='c-s-x c-s-end'>{reach:g} m</span>"
        "<span class='c-s-title' title='Beams of each cluster over its range; those within the band pass'>"
        "band: passes</span></div>"
    )
