"""The picture of one reflector's gate at true scale, as SVG, and the same in numbers. Text from values, no widget.

Up is north, as on the floor. The picture's unit is the pixel of a square of SIDE; `Frame` leads there from metres.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from commission.app.base import theme
from commission.app.base.panel import escaped
from commission.geometry.arrays import FloatArray
from commission.geometry.gaussian import ellipse_axes
from commission.localization.estimate import Status
from commission.site.quantity import DEGREES, MILLIMETRES, PERCENT, number_text
from commission.studies.association import Association, Cloud, JudgedDetection, Rival

SIDE = 280.0
"""Side of the square picture [pixels of its own; it is drawn as large as there is room]."""
HALVES = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.5, 10.0)
"""Halves of its side that it has, times a power of ten: it does not breathe with every scan."""
MARGIN = 1.12
LARGEST_RING = 2.0
"""Size of a reflector, in sizes of the rest, up to which all of it is seen."""
LINES_PX = 45.0
"""Between two lines of the grid at least."""
FEWEST_PX = 7.0
"""The same of its finer lines."""
ARM_PX = 6.0
"""Half of the cross of a detection."""
WORDS_PX = 96.0
"""Room that a length beside a cross takes where the picture is small and its words are large in it."""
RIVALS_TOLD = 3
CLOUD_COLOR = theme.css(theme.CLOUD)
VERDICTS = {
    Status.INLIER: "inlier",
    Status.OUTLIER_DETECTOR: "rejected by its beams",
    Status.OUTLIER_ASSOCIATION: "rejected",
}
COLORS = {
    Status.INLIER: theme.INLIER,
    Status.OUTLIER_DETECTOR: theme.OUTLIER_DETECTOR,
    Status.OUTLIER_ASSOCIATION: theme.OUTLIER_ASSOCIATION,
}


@dataclass(frozen=True, slots=True)
class Frame:
    """From metres about the reflector to the picture."""

    half: float
    """Half of the side of what is seen [m]."""

    @property
    def pixels(self) -> float:
        """Pixels per metre."""
        return 0.5 * SIDE / self.half

    def at(self, offset: FloatArray) -> tuple[float, float]:
        """Return where a place is drawn that lies so far from the reflector [m], map axes."""
        return 0.5 * SIDE + self.pixels * float(offset[0]), 0.5 * SIDE - self.pixels * float(offset[1])


def frame_of(found: Association) -> Frame:
    """Return the scale at which reflector, gate, detection and cloud are seen."""
    reaches = [*(np.sqrt(found.estimate.gate * np.diag(found.covariance)))]
    if found.detection is not None:
        reaches += [*np.abs(found.detection.offset), *np.abs(found.detection.corrected)]
    if len(found.cloud.points) > 1:
        spread = found.axes @ found.cloud.covariance @ found.axes.T
        reaches += [*(np.abs(found.axes @ found.cloud.mean) + 2.0 * np.sqrt(np.diag(spread)))]
    # Of a ring far larger than all that, an arc is enough.
    reaches.append(min(found.reflector.reckoned_radius, LARGEST_RING * max(reaches)))
    wanted = MARGIN * max(float(reach) for reach in reaches)
    power = 10.0 ** math.floor(math.log10(wanted))
    return Frame(next(half * power for half in HALVES if half * power >= wanted))


def grid_steps(frame: Frame) -> tuple[float, float]:
    """Steps of the grid's lines and of its finer ones [m]: 1, 2 or 5 times a power of ten millimetres."""
    nice = [digit * 10.0**power for power in range(-6, 3) for digit in (1.0, 2.0, 5.0)]
    main = next(step for step in nice if step * frame.pixels >= LINES_PX)
    fine = (step for step in nice if step * frame.pixels >= FEWEST_PX and is_part(step, main))
    return main, next(fine)


def is_part(step: float, whole: float) -> bool:
    """Whether a step goes into another one without rest."""
    return abs(whole / step - round(whole / step)) < 1e-6


def picture(found: Association) -> str:
    """Return the picture as SVG."""
    frame = frame_of(found)
    parts = [
        _grid(frame),
        _sight(found),
        _ellipse("c-a-gate", frame, np.zeros(2), found.estimate.gate * found.covariance),
        *(_rival(frame, found, rival) for rival in found.rivals),
        _ring(frame, np.zeros(2), found.reflector.reckoned_radius, theme.css(theme.REFLECTOR), _ring_words(found)),
        _cloud(frame, found),
        *(_cross(frame, each, "c-a-other", CLOUD_COLOR, 4.0) for each in found.others if _is_seen(frame, each)),
        "" if found.detection is None else _innovation(frame, found.detection),
        _scale_bar(frame),
    ]
    return (
        f"<svg class='c-a-picture' viewBox='0 0 {SIDE:g} {SIDE:g}' data-half='{frame.half:.6g}' "
        f"data-reflector='{escaped(found.reflector.id)}'>{''.join(parts)}</svg>"
    )


def _is_seen(frame: Frame, offset: FloatArray) -> bool:
    return bool(np.abs(offset).max() < frame.half)


def _grid(frame: Frame) -> str:
    """The grid through the reflector, its finer lines weaker."""
    main, fine = grid_steps(frame)
    parts: list[str] = []
    for step, name in ((fine, "c-a-fine"), (main, "c-a-line")):
        count = math.floor(frame.half / step)
        ends = [0.5 * SIDE + number * step * frame.pixels for number in range(-count, count + 1)]
        lines = "".join(f"M{end:.2f} 0V{SIDE:g}M0 {end:.2f}H{SIDE:g}" for end in ends)
        parts.append(f"<path class='{name}' d='{lines}'/>")
    return "".join(parts)


def _sight(found: Association) -> str:
    """The ray from the scanner."""
    x, y = -0.5 * SIDE * found.along[0], 0.5 * SIDE * found.along[1]
    scale = 1.0 / max(abs(found.along[0]), abs(found.along[1]))
    end = 0.5 * SIDE + scale * x, 0.5 * SIDE + scale * y
    return (
        f"<path class='c-a-ray' d='M{end[0]:.1f} {end[1]:.1f}L{0.5 * SIDE:g} {0.5 * SIDE:g}'>"
        f"<title>ray from the scanner, {found.predicted[0]:.3f} m away</title></path>"
    )


def _ellipse(name: str, frame: Frame, center: FloatArray, covariance: FloatArray) -> str:
    """The outline of a region: all within one sigma of a covariance [m^2], map axes."""
    (longer, shorter), angle = ellipse_axes(covariance)
    x, y = frame.at(center)
    return (
        f"<ellipse class='{name}' cx='{x:.3f}' cy='{y:.3f}' rx='{longer * frame.pixels:.4f}' "
        f"ry='{shorter * frame.pixels:.4f}' transform='rotate({-DEGREES.of(float(angle)):.5f} {x:.3f} {y:.3f})'/>"
    )


def _ring_words(found: Association) -> str:
    radius = found.reflector.radius
    known = f"radius {MILLIMETRES.text(radius, '.0f')}" if radius is not None else "radius unknown, drawn as reckoned"
    return f"{found.reflector.id}, {known}"


def _ring(frame: Frame, center: FloatArray, radius: float, color: str, words: str) -> str:
    """A reflector at its true radius, with a dot where its detection was predicted."""
    x, y = frame.at(center)
    return (
        f"<circle class='c-a-ring' cx='{x:.3f}' cy='{y:.3f}' r='{radius * frame.pixels:.3f}' stroke='{color}'>"
        f"<title>{escaped(words)}</title></circle><circle cx='{x:.3f}' cy='{y:.3f}' r='2.2' fill='{color}'/>"
    )


def _rival(frame: Frame, found: Association, rival: Rival) -> str:
    """Another reflector with its gate, as far as it is seen."""
    x, y = frame.at(rival.offset)
    name = f"<text class='c-a-word' x='{x + 5:.1f}' y='{y - 5:.1f}'>{escaped(rival.reflector.id)}</text>"
    return (
        _ellipse("c-a-rival", frame, rival.offset, found.estimate.gate * rival.covariance)
        + _ring(frame, rival.offset, rival.reflector.reckoned_radius, CLOUD_COLOR, rival.reflector.id)
        + (name if _is_seen(frame, rival.offset) else "")
    )


def _cloud(frame: Frame, found: Association) -> str:
    """The last innovations as dots along and across the ray of now; their mean and 1-sigma ellipse."""
    cloud, axes = found.cloud, found.axes
    places = [frame.at(each) for each in cloud.points @ axes.T if _is_seen(frame, each)]
    dots = "".join(f"M{x:.1f} {y:.1f}h0" for x, y in places)
    parts = [f"<path class='c-a-cloud' stroke='{CLOUD_COLOR}' d='{dots}'/>"] if dots else []
    if len(cloud.points) > 1:
        mean = axes @ cloud.mean
        parts.append(_ellipse("c-a-spread", frame, mean, axes @ cloud.covariance @ axes.T))
        parts.append(_cross(frame, mean, "c-a-mean", CLOUD_COLOR, 3.0))
    return "".join(parts)


def _cross(frame: Frame, offset: FloatArray, name: str, color: str, arm: float) -> str:
    x, y = frame.at(offset)
    return (
        f"<path class='{name}' data-x='{x:.4f}' data-y='{y:.4f}' stroke='{color}' "
        f"d='M{x - arm:.2f} {y:.2f}h{2 * arm:g}M{x:.2f} {y - arm:.2f}v{2 * arm:g}'/>"
    )


def _innovation(frame: Frame, detection: JudgedDetection) -> str:
    """The detection, the line to it from where it was predicted, and where it lies after the correction."""
    color, (x, y) = theme.css(COLORS[detection.status]), frame.at(detection.offset)
    after = frame.at(detection.corrected)
    middle = 0.5 * SIDE
    # Beside the cross, on the side away from the reflector, and where that has no room for it on the other one.
    is_right = middle <= x <= SIDE - WORDS_PX or x < WORDS_PX
    words = (
        f"<text class='c-a-length' x='{x + (9 if is_right else -9):.1f}' y='{y + (14 if y >= middle else -8):.1f}' "
        f"text-anchor='{'start' if is_right else 'end'}'>"
        f"{MILLIMETRES.text(detection.length, '.1f')}</text>"
    )
    return (
        f"<path class='c-a-vector' d='M{middle:g} {middle:g}L{x:.2f} {y:.2f}' stroke='{color}'/>"
        f"<circle class='c-a-after' cx='{after[0]:.2f}' cy='{after[1]:.2f}' r='3.5'>"
        "<title>the detection after the correction</title></circle>"
        + _cross(frame, detection.offset, "c-a-detection", color, ARM_PX)
        + words
    )


def _scale_bar(frame: Frame) -> str:
    main, fine = grid_steps(frame)
    length, y = main * frame.pixels, SIDE - 9.0
    return (
        f"<path class='c-a-bar' d='M8 {y - 4:g}V{y:g}H{8 + length:.2f}V{y - 4:.2f}'/>"
        f"<text class='c-a-word' x='8' y='{y - 8.0:g}'>{_short(main)}, grid {_short(fine)}</text>"
    )


def _short(metres: float) -> str:
    """A length without digits that say nothing."""
    return f"{MILLIMETRES.of(metres):g} mm"


def head(found: Association, time: float) -> str:
    """Return what is looked at and why, as html."""
    which = "worst d² of this scan" if found.is_worst else "selected"
    return (
        f"<div class='c-a-head'><b>{escaped(found.reflector.id)}</b> {which}"
        f"<span>{time:.2f} s</span></div>{_verdict(found)}"
    )


def _verdict(found: Association) -> str:
    """Say whether the detection is inside its gate."""
    detection, gate = found.detection, found.estimate.gate
    if detection is None:
        return "<div class='c-a-verdict'>not detected in this scan</div>"
    where = "inside" if detection.d2 <= gate else "outside"
    color = theme.css(COLORS[detection.status])
    return (
        f"<div class='c-a-verdict' style='color:{color}'>d² {detection.d2:.2f} {'≤' if where == 'inside' else '&gt;'} "
        f"gate {gate:.2f}: {where}, {verdict(found, detection)}</div>"
    )


def verdict(found: Association, detection: JudgedDetection) -> str:
    """Return what became of the detection, and why, in words."""
    if detection.status is Status.INLIER and detection.taken_for == found.reflector.id:
        return VERDICTS[detection.status]
    if detection.status is Status.OUTLIER_ASSOCIATION and detection.d2 <= found.estimate.gate:
        return "rejected: a nearer detection has it"
    return VERDICTS[detection.status]


def rows(found: Association) -> list[tuple[str, str]]:
    """Return the numbers, line by line."""
    expected_range, expected_bearing = found.predicted
    along, across = found.sigmas
    shown: list[tuple[str, str]] = []
    detection = found.detection
    if detection is not None:
        shown += [
            ("Innovation", MILLIMETRES.text(detection.length, ".1f")),
            ("along, across the ray", _pair(detection.along, detection.across)),
            ("d² / gate", f"{detection.d2:.2f} / {found.estimate.gate:.2f} ({_percent(found.probability)})"),
        ]
    shown.append(("1σ expected", _pair(along, across, sign="")))
    if detection is not None:
        shown += [
            ("Range / expected", f"{detection.measured[0]:.3f} / {expected_range:.3f} m"),
            ("Bearing / expected", DEGREES.against(detection.measured[1], expected_bearing, (".2f", ".2f"))),
            ("Beams / passing", _beams(found, detection)),
        ]
    else:
        shown += [
            ("Expected at", f"{expected_range:.3f} m, {DEGREES.text(expected_bearing, '.2f')}"),
            ("Beams passing", _window(found)),
        ]
    shown += [
        (f"Rival {escaped(rival.reflector.id)}", f"d² {rival.d2:.2f}, likelihood ×{number_text(rival.likelihood, 2)}")
        for rival in found.rivals[:RIVALS_TOLD]
    ]
    return [*(shown if found.rivals else [*shown, ("Rivals", "none near")]), *_cloud_rows(found.cloud)]


def _cloud_rows(cloud: Cloud) -> list[tuple[str, str]]:
    count = len(cloud.points)
    whole = "" if cloud.is_whole else ", of the last 16,384 scans"
    shown = [("Last innovations", f"{count}, {cloud.accepted} accepted{whole}")]
    if count > 1:
        sigmas = np.sqrt(np.diag(cloud.covariance))
        shown += [
            ("their mean", _pair(*cloud.mean.tolist())),
            ("their 1σ", _pair(*sigmas.tolist(), sign="")),
        ]
    return shown


def _pair(along: float, across: float, sign: str = "+") -> str:
    """Return two lengths [m] as they are written."""
    return f"{MILLIMETRES.number(along, f'{sign}.1f')}, {MILLIMETRES.text(across, f'{sign}.1f')}"


def _percent(probability: float) -> str:
    return f"{PERCENT.of(probability):g} %"


def _beams(found: Association, detection: JudgedDetection) -> str:
    """Beams of the cluster against those with which it passes."""
    if detection.beams == 0:
        return "the sensor itself detects"
    likely = "" if math.isnan(detection.expected_beams) else f", likely {detection.expected_beams:.1f}"
    return f"{detection.beams} / {_window(found)}{likely}"


def _window(found: Association) -> str:
    return "any: filter off" if found.widths is None else f"{found.widths[0]} to {found.widths[1]}"
