"""A prediction along a route as files for spreadsheets and scripts: a row per metre, and a summary. Writing only."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from commission.io.atomic import write_text
from commission.io.table_writer import angle, figure, place, write_table
from commission.planning.dependence import Dependence, RouteDependence
from commission.planning.error_budget import CONTRIBUTIONS, PredictedErrors
from commission.planning.route_prediction import RoutePrediction
from commission.planning.station_accuracy import StationAccuracy
from commission.site.reflectors import ReflectorMap
from commission.studies.kinds import KINDS
from commission.studies.kinds_prediction import KindsPrediction

PREDICTION = "prediction.csv"
DEPENDENTS = "dependents.csv"
FAILURES = "failures.csv"
SUMMARY = "summary.json"
KINDS_FILE = "kinds.csv"
FILES = (PREDICTION, DEPENDENTS, FAILURES, KINDS_FILE, SUMMARY)
"""All that may be written."""
COLUMNS = (
    *("metre", "x", "y", "theta", "two_sigma_x", "two_sigma_y", "two_sigma_theta"),
    *("visible", "on_odometry", "over_limit", "mode"),
    *("error_two_sigma_x", "error_two_sigma_y", "error_two_sigma_theta"),
    *(f"{part}_two_sigma_position" for part in CONTRIBUTIONS),
    *("two_sigma_position", "error_two_sigma_position"),
    *(f"{part}_share" for part in CONTRIBUTIONS),
)
# `load` is the share of the limit: files keep the column that others read, whatever the page calls it.
KINDS_COLUMNS = ("metre", "two_sigma_position", "two_sigma_theta", "stops", *(kind.replace(" ", "_") for kind in KINDS))
FAILURE_COLUMNS = ("blocked", "reflector_id", "route", "failing_metres", "load", "metres")
DEPENDENT_COLUMNS = ("reflector_id", "failure", "route", "failing_metres", "load", "metres")


def write_kinds(folder: Path, found: KindsPrediction) -> None:
    """Write `kinds.csv`: what is expected in each metre by every kind; replaced whole or not at all.

    Parameters
    ----------
    folder : made when missing.
    found : metres and radians; `stops` is a share of the drives, and what each kind corrects is a number of cycles.

    Raises
    ------
    FileFormatError
        the file cannot be written.
    """
    columns = (found.position, found.heading, found.stops, *found.corrections.T)
    rows = zip(found.metre.tolist(), *(map(figure, column.tolist()) for column in columns), strict=True)
    write_table(folder / KINDS_FILE, KINDS_COLUMNS, rows)


def write_prediction(
    folder: Path,
    route: str,
    prediction: RoutePrediction,
    errors: PredictedErrors,
    stations: Sequence[StationAccuracy] = (),
) -> None:
    """Write `prediction.csv` (the worst of each metre) and `summary.json`; each is replaced whole or not at all.

    Parameters
    ----------
    folder : made when missing.
    route : name of the route.
    prediction, errors : of that route.
    stations : uncertainty at the stations on it; a list in the summary.

    Raises
    ------
    FileFormatError
        a file cannot be written.
    """
    metres = prediction.per_metre()
    error, shares = errors.position_per_metre(metres)
    x, y, theta = prediction.drive.poses[metres.first].T.tolist()
    columns = [
        metres.metre.tolist(),
        *(map(place, x), map(place, y), map(angle, theta)),
        *(map(figure, column) for column in metres.two_sigma.T.tolist()),
        metres.seen.tolist(),
        map(figure, metres.on_odometry.tolist()),
        np.isin(metres.metre, prediction.failing_metres()).astype(np.int64).tolist(),
        np.where(metres.fails, "fail", "operational").tolist(),
        *(map(figure, column) for column in errors.per_metre(metres).T.tolist()),
        *(map(figure, column) for column in errors.parts_per_metre(metres).T.tolist()),
        *(map(figure, column.tolist()) for column in (metres.position, error)),
        *(map(figure, column) for column in shares.T.tolist()),
    ]
    write_table(folder / PREDICTION, COLUMNS, zip(*columns, strict=True))
    entries = {**summary(route, prediction, errors), "stations": [_station_entry(station) for station in stations]}
    write_text(folder / SUMMARY, json.dumps(entries, indent=2, allow_nan=False) + "\n")


def summary(
    route: str, prediction: RoutePrediction, errors: PredictedErrors
) -> dict[str, str | int | float | list[float]]:
    """Return what a prediction comes to; metres, seconds and radians.

    Parameters
    ----------
    route : its name.
    prediction : what the filter will say.
    errors : how far it will be off.
    """
    x, y, theta = (float(value) for value in prediction.two_sigma.max(axis=0))
    error_x, error_y, error_theta = (float(value) for value in errors.two_sigma.max(axis=0))
    return {
        "route": route,
        "length_m": prediction.drive.length,
        "duration_s": float(prediction.drive.stamps_ns[-1]) * 1e-9,
        "scans": len(prediction.drive),
        "two_sigma_x_max_m": x,
        "two_sigma_y_max_m": y,
        "two_sigma_theta_max_rad": theta,
        "error_two_sigma_x_max_m": error_x,
        "error_two_sigma_y_max_m": error_y,
        "error_two_sigma_theta_max_rad": error_theta,
        "two_sigma_position_max_m": float(prediction.position_two_sigma.max()),
        "error_two_sigma_position_max_m": float(errors.position_two_sigma.max()),
        **{
            f"{part}_two_sigma_position_max_m": float(largest)
            for part, largest in zip(CONTRIBUTIONS, errors.part_two_sigma.max(axis=0), strict=True)
        },
        "position_limit_m": prediction.limits.position_limit,
        "heading_limit_rad": prediction.limits.heading_limit,
        "metres_over_limit": len(prediction.failing_metres()),
        "trips_m": prediction.trips().tolist(),
        "recoveries_m": prediction.recoveries().tolist(),
        "visible_min": int(prediction.seen.min()),
        "visible_mean": float(prediction.seen.mean()),
        "on_odometry_max_m": float(prediction.on_odometry.max()),
    }


def _station_entry(station: StationAccuracy) -> dict[str, str | float | bool]:
    return {
        "station": station.station,
        "metre": station.metre,
        "two_sigma_m": station.two_sigma,
        "error_two_sigma_m": station.error,
        **{f"{part}_two_sigma_m": share for part, share in zip(CONTRIBUTIONS, station.parts, strict=True)},
        "required_m": station.required,
        "met": station.is_met,
    }


def write_dependents(folder: Path, ranked: Sequence[Dependence], reflectors: ReflectorMap) -> None:
    """Write `dependents.csv`: a row per reflector and route, in the order given.

    Parameters
    ----------
    folder : made when missing.
    ranked : what depends on each reflector.
    reflectors : the map that names them.

    Raises
    ------
    FileFormatError
        the file cannot be written.
    """
    rows = (
        (
            reflectors.reflectors[each.reflector].id,
            each.failure,
            part.route,
            len(part.metres),
            figure(part.limit_share),
            metres,
        )
        for each in ranked
        for part in each.routes
        for metres in (" ".join(map(str, part.metres.tolist())),)
    )
    write_table(folder / DEPENDENTS, DEPENDENT_COLUMNS, rows)


def write_failures(folder: Path, failures: Sequence[Dependence], reflectors: ReflectorMap) -> None:
    """Write `failures.csv`: a row per failure and route, in the order of failing.

    Parameters
    ----------
    folder : made when missing.
    failures : each with the metres that fail beside those that failed before; numbered from 1 in the file.
    reflectors : the map that names them.

    Raises
    ------
    FileFormatError
        the file cannot be written.
    """
    rows = (
        (number, reflectors.reflectors[each.reflector].id, *_part(part))
        for number, each in enumerate(failures, start=1)
        for part in each.routes
    )
    write_table(folder / FAILURES, FAILURE_COLUMNS, rows)


def _part(part: RouteDependence) -> tuple[str, int, str, str]:
    """Cells of what fails on one route."""
    return part.route, len(part.metres), figure(part.limit_share), " ".join(map(str, part.metres.tolist()))
