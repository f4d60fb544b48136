"""What the localizer says as state messages of VDA 5050 (versions 2.1 and 3.0), one JSON object a line. Writing only.

A localizer knows neither orders nor batteries: what the specification asks for besides has the value of a vehicle that
does nothing and lacks nothing. What it says is whether the position can be trusted, and how far it may be off.
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np

from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import IntArray
from commission.io.atomic import atomic_file
from commission.localization.estimate import Mode
from commission.studies.run import RunResult

PERIOD_NS = 1_000_000_000
"""Time between two messages at least, where the mode stays [ns]; each change of the mode is told at its own scan."""
ERROR = "LOCALIZATION_ERROR"
WHY = {
    Mode.FAIL: "the position is too uncertain, or nothing confirms it yet",
    Mode.LOST: "too many detections fit no reflector",
    Mode.INITIALIZING: "the vehicle is looking for where it is",
}
"""What stands in the error, by the mode."""
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


class StateVersion(StrEnum):
    """Version of the specification."""

    V2 = "2.1.0"
    V3 = "3.0.0"


def write_states(path: Path, result: RunResult, map_id: str, version: StateVersion = StateVersion.V2) -> int:
    """Write the state messages of a run; return their number. The file is replaced whole or not at all.

    Parameters
    ----------
    path : of the file.
    result : of the run.
    map_id : identification of the map, as the orders have it.
    version : of the messages.
    """
    count = 0
    with atomic_file(path) as file:
        for message in state_messages(result, map_id, version):
            file.write(json.dumps(message, ensure_ascii=False, allow_nan=False).encode() + b"\n")
            count += 1
    return count


def state_messages(result: RunResult, map_id: str, version: StateVersion = StateVersion.V2) -> Iterator[dict[str, Any]]:
    """Deliver the state messages of a run: at each change of the mode, else at the first scan a second later.

    Parameters
    ----------
    result : of the run.
    map_id : identification of the map, as the orders have it.
    version : of the messages.

    Yields
    ------
    message : of the topic `state`; headerId counts from 0. Where the vehicle is not operational, the position is that
        of the filter, which the vehicle is not given. deviationRange is the 2-sigma that the supervisor holds against
        its limit [m]; it is left out where nobody knows it.
    """
    columns = result.columns
    for header, cycle in enumerate(told_cycles(columns.stamps_ns, columns.modes.astype(np.int64)).tolist()):
        mode = Mode(int(columns.modes[cycle]))
        x, y, theta = columns.means[cycle].tolist()
        localized = mode is Mode.OPERATIONAL
        position: dict[str, Any] = {}
        if all(map(math.isfinite, (x, y, theta))):
            position = {"x": x, "y": y, "theta": wrap_scalar(theta), "mapId": map_id}
            position["localized" if version is StateVersion.V3 else "positionInitialized"] = localized
            deviation = float(result.position_two_sigma[cycle])
            position |= {"deviationRange": deviation} if math.isfinite(deviation) else {}
        errors = [] if localized else [{"errorType": ERROR, "errorDescription": WHY[mode], "errorLevel": "FATAL"}]
        yield {
            "headerId": header,
            "timestamp": timestamp(int(columns.stamps_ns[cycle]), version),
            **_unknown(version),
            **({"mobileRobotPosition" if version is StateVersion.V3 else "agvPosition": position} if position else {}),
            "errors": errors,
        }


def told_cycles(stamps_ns: IntArray, modes: IntArray) -> IntArray:
    """(M,) cycles that have a message: the first one, each change of the mode, and the first a second after one.

    Parameters
    ----------
    stamps_ns : (K,) of the cycles [ns], ascending.
    modes : (K,) mode after each.
    """
    told: list[int] = []
    changed = np.flatnonzero(np.diff(modes, prepend=-1))
    for first, last in itertools.pairwise([*changed.tolist(), len(modes)]):
        cycle = first
        while cycle < last:
            told.append(cycle)
            cycle = max(int(np.searchsorted(stamps_ns, stamps_ns[cycle] + PERIOD_NS)), cycle + 1)
    return np.array(told, dtype=np.int64)


def timestamp(stamp_ns: int, version: StateVersion) -> str:
    """Return a stamp since 1970 [ns] in ISO 8601, UTC: to hundredths of a second in 2.1, thousandths in 3.0."""
    moment = EPOCH + timedelta(microseconds=stamp_ns // 1000)
    digits = 3 if version is StateVersion.V3 else 2
    return moment.strftime("%Y-%m-%dT%H:%M:%S.") + f"{moment.microsecond:06d}"[:digits] + "Z"


def _unknown(version: StateVersion) -> dict[str, Any]:
    """What the specification asks for and a localizer does not know: a vehicle without an order that lacks nothing."""
    is_new = version is StateVersion.V3
    return {
        "version": version.value,
        "manufacturer": "commission",
        "serialNumber": "localizer",
        "orderId": "",
        "orderUpdateId": 0,
        "lastNodeId": "",
        "lastNodeSequenceId": 0,
        "nodeStates": [],
        "edgeStates": [],
        "driving": False,
        "actionStates": [],
        **({"instantActionStates": []} if is_new else {}),
        **(
            {"powerSupply": {"stateOfCharge": 100.0, "charging": False}}
            if is_new
            else {"batteryState": {"batteryCharge": 100.0, "charging": False}}
        ),
        "operatingMode": "AUTOMATIC",
        "safetyState": {("activeEmergencyStop" if is_new else "eStop"): "NONE", "fieldViolation": False},
    }
