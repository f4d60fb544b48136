"""What is expected along a route: in numbers, then over its metres in the colors of the ribbon on the floor."""

from __future__ import annotations

import numpy as np

from commission.app.base import theme
from commission.app.base.panel import escaped, table
from commission.app.prediction.driven import DrivenMetres
from commission.app.prediction.limit_colors import limit_classes, palette
from commission.app.prediction.stacks import Stacked, stack_legend, stacked
from commission.app.prediction.tracks import Limited, Plain, TrackAxis, limited, plain, round_up
from commission.app.prediction.view import RouteView
from commission.planning.error_budget import CONTRIBUTIONS
from commission.planning.station_accuracy import StationAccuracy
from commission.site.quantity import DEGREES, MILLIMETRES, PERCENT
from commission.studies.kinds import KINDS

MOST_BARS = 120
MOST_STOPS = 6


def chart(route: RouteView, run: DrivenMetres | None) -> str:
    """Return what is expected along a route.

    Parameters
    ----------
    route : the prediction.
    run : a run to lay over it; none where there is none.
    """
    metres, limits = route.metres, route.prediction.limits
    starts = np.arange(0, len(metres.metre), max(1, -(-len(metres.metre) // MOST_BARS)))
    axis = _axis(route, starts)
    worst = np.maximum.reduceat(np.column_stack((metres.position, metres.two_sigma[:, 2])), starts, axis=0)
    errors = np.maximum.reduceat(route.errors, starts, axis=0)
    position = Limited(
        title="2σ of position, as the filter says [mm]",
        levels=MILLIMETRES.of(worst[:, 0]),
        limit=MILLIMETRES.of(limits.position_limit),
        errors=MILLIMETRES.of(errors[:, 0]),
        driven=None if run is None else (run.metres, MILLIMETRES.of(run.two_sigma[:, 0])),
    )
    heading = Limited(
        title="2σ of heading, as the filter says [°]",
        levels=DEGREES.of(worst[:, 1]),
        limit=DEGREES.of(limits.heading_limit),
        errors=DEGREES.of(errors[:, 1]),
        driven=None if run is None else (run.metres, DEGREES.of(run.two_sigma[:, 1])),
    )
    seen = np.minimum.reduceat(metres.seen, starts)
    alone = np.maximum.reduceat(metres.on_odometry, starts)
    risk = np.maximum.reduceat(route.risk, starts)
    drawn = [
        limited(position, axis),
        limited(heading, axis),
        *_by_every_kind(route),
        *_stacks(route, axis, starts),
        plain(Plain("Fewest reflectors seen", seen, (2.0, float(max(4, seen.max())))), axis),
        plain(Plain("On odometry alone [m]", alone, (round_up(max(0.5, float(alone.max()))),)), axis),
    ]
    if route.risks:
        drawn.append(plain(Plain("Chance of a wrong association [%]", PERCENT.of(risk), (50.0,)), axis))
    return (
        f"<div class='c-prediction' style='padding:2px 6px'>{table(_numbers(route))}{_stations(route.stations)}"
        f"{''.join(drawn)}<div class='c-note'>{_note(route, run)}</div></div>"
    )


def _axis(route: RouteView, starts: np.ndarray) -> TrackAxis:
    """The bars begin at these metres; their color is that of the ribbon."""
    prediction = route.prediction
    shades = [theme.css(color) for color in palette()]
    fills = tuple(shades[index] for index in limit_classes(np.maximum.reduceat(route.limit_shares, starts)))
    metres = route.metres.metre[starts].astype(float)
    return TrackAxis(
        length=prediction.drive.length,
        metres=metres,
        fills=fills,
        stops=prediction.trips(),
        recoveries=prediction.recoveries(),
    )


def _by_every_kind(route: RouteView) -> list[str]:
    """What the filter says by all that corrects it, and how often each kind does; nothing where there is one kind."""
    driven = route.driven
    if driven is None:
        return []
    starts = np.arange(0, len(driven.metre), max(1, -(-len(driven.metre) // MOST_BARS)))
    levels = np.maximum.reduceat(np.column_stack((driven.position, driven.heading)), starts, axis=0)
    allowed = route.prediction.limits
    shares = np.maximum(levels[:, 0] / allowed.position_limit, levels[:, 1] / allowed.heading_limit)
    shades = [theme.css(color) for color in palette()]
    axis = TrackAxis(
        length=driven.length,
        metres=driven.metre[starts].astype(float),
        fills=tuple(shades[index] for index in limit_classes(shares)),
        stops=driven.metre[driven.stops > 0.5].astype(float),
        recoveries=np.empty(0),
    )
    position = Limited(
        title=f"2σ of position by {', '.join(driven.kinds)} [mm]",
        levels=MILLIMETRES.of(levels[:, 0]),
        limit=MILLIMETRES.of(allowed.position_limit),
    )
    named = zip(KINDS, driven.corrections.mean(axis=0).tolist(), strict=True)
    counts = ", ".join(f"{kind} {count:.1f}" for kind, count in named if kind in driven.kinds)
    largest = MILLIMETRES.against(driven.position.max(), allowed.position_limit)
    heading = DEGREES.against(driven.heading.max(), allowed.heading_limit, (".2f", ".1f"))
    rows = [("Every kind, largest 2σ", f"{largest}, {heading}"), ("Corrections a metre", counts)]
    return [f"<div class='c-every-kind'>{table(rows)}</div>", limited(position, axis)]


def _note(route: RouteView, run: DrivenMetres | None) -> str:
    if route.outdated:
        return "predicting anew …"
    lines = ["color: share of the limit", "violet: 2σ of the error that noise and uncertainty make"]
    if len(route.prediction.trips()):
        lines.append("red line: stops, green line: may drive again")
    lines.append("white line: the run that is loaded" if run is not None else "a run along this route is laid over it")
    return "; ".join(lines)


def _numbers(route: RouteView) -> list[tuple[str, str]]:
    """What matters most, in numbers."""
    prediction, metres, limits = route.prediction, route.metres, route.prediction.limits
    largest, error = metres.two_sigma[:, 2].max(), route.errors.max(axis=0)
    rows = [
        ("Length", f"{prediction.drive.length:.1f} m"),
        ("Worst 2σ position / limit", MILLIMETRES.against(metres.position.max(), limits.position_limit)),
        ("Worst 2σ heading / limit", DEGREES.against(largest, limits.heading_limit, (".2f", ".1f"))),
        ("Error, 2σ position", MILLIMETRES.text(error[0], ".1f")),
        ("Error, 2σ heading", DEGREES.text(error[1], ".2f")),
        *_budget(route),
        ("Fewest reflectors seen", str(int(metres.seen.min()))),
        ("Longest on odometry", f"{metres.on_odometry.max():.1f} m"),
        ("Supervisor stops", _places(prediction.trips())),
    ]
    if len(prediction.trips()):
        rows.append(("May drive again", _places(prediction.recoveries())))
    return rows


def _budget(route: RouteView) -> list[tuple[str, str]]:
    """What each source of error contributes alone, at most: squares add up, these do not."""
    alone = zip(CONTRIBUTIONS, route.alone.max(axis=0), strict=True)
    return [(f"… by {name} alone", MILLIMETRES.text(part, ".1f")) for name, part in alone]


def _stacks(route: RouteView, axis: TrackAxis, starts: np.ndarray) -> list[str]:
    """What the errors of position and heading come from, one above the other, and the colors of that."""
    supervisor = route.prediction.limits
    worst = [_worst_bins(route.errors[:, which], starts) for which in (0, 1)]
    position = Stacked(
        title="Error of position, 2σ by source [mm]",
        levels=MILLIMETRES.of(route.errors[worst[0], 0]),
        shares=route.position_shares[worst[0]],
        limit=MILLIMETRES.of(supervisor.position_limit),
        limit_text=MILLIMETRES.text(supervisor.position_limit),
    )
    heading = Stacked(
        title="Error of heading, 2σ by source [°]",
        levels=DEGREES.of(route.errors[worst[1], 1]),
        shares=route.heading_shares[worst[1]],
        limit=DEGREES.of(supervisor.heading_limit),
        limit_text=DEGREES.text(supervisor.heading_limit, ".1f"),
    )
    return [stacked(position, axis), stacked(heading, axis), stack_legend(CONTRIBUTIONS)]


def _worst_bins(values: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """(N,) the metre with the largest value of each stretch."""
    ends = (*starts[1:].tolist(), len(values))
    return np.array([first + values[first:end].argmax() for first, end in zip(starts.tolist(), ends, strict=True)])


def _places(metres: np.ndarray) -> str:
    """Write metres of the way."""
    shown = ", ".join(f"{metre:.0f}" for metre in metres[:MOST_STOPS]) + (" …" if len(metres) > MOST_STOPS else "")
    return f"at {shown} m" if len(metres) else "nowhere"


def _stations(stations: tuple[StationAccuracy, ...]) -> str:
    """Each station on the route: the larger one of the filter's and of the true 2-sigma against what it requires."""
    if not stations:
        return ""
    good, bad = theme.css(theme.RECOVERY), theme.css(theme.OVER_LIMIT)
    rows = [
        (
            f"{escaped(each.station)}, {each.metre:.0f} m",
            f"{MILLIMETRES.against(each.expected, each.required)} "
            f"<span style='color:{good if each.is_met else bad}'>{'met' if each.is_met else 'not met'}</span>"
            f"<div class='c-note'>{_station_parts(each)}</div>",
        )
        for each in stations
    ]
    title = "<div style='font-size:11px;opacity:.75;padding-top:5px'>Stations: 2σ x, y / required, and by source</div>"
    return f"<div class='c-stations'>{title}{table(rows)}</div>"


def _station_parts(station: StationAccuracy) -> str:
    """What the error at a station comes from."""
    named = zip(CONTRIBUTIONS, station.parts, strict=True)
    return ", ".join(f"{name} {MILLIMETRES.number(part, '.1f')}" for name, part in named) + " mm"
