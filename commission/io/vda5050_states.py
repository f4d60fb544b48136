"""What the localizer says as state messages of VDA 5050 (versions 2.1 and 3.0), one JSON object a line. Writing only.

A localizer knows neither orders nor batteries: what the specification asks for besides has the value of a vehicle that
does nothing and lacks nothing. What it says is whether the position can be trusted, and how far it may be off.
"""

from __future__ import annotations

import itertools
import json
import logging
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np

from commission.errors import UsageError
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray, IntArray
from commission.io.atomic import atomic_file, cannot_write
from commission.localization.estimate import Estimate, Mode
from commission.localization.supervisor import position_two_sigma
from commission.site.parameters import SupervisorParameters
from commission.studies.run import RunResult

log = logging.getLogger(__name__)

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
        mode, stamp_ns = Mode(int(columns.modes[cycle])), int(columns.stamps_ns[cycle])
        pose = columns.means[cycle], float(result.position_two_sigma[cycle])
        yield _message((header, stamp_ns), mode, pose, (map_id, version))


def _message(
    head: tuple[int, int], mode: Mode, pose: tuple[FloatArray, float], of: tuple[str, StateVersion]
) -> dict[str, Any]:
    """Return a message of number and stamp [ns], mode, pose (3,) with its deviation [m], map and version."""
    (header, stamp_ns), (mean, deviation), (map_id, version) = head, pose, of
    x, y, theta = mean.tolist()
    localized = mode is Mode.OPERATIONAL
    position: dict[str, Any] = {}
    if all(map(math.isfinite, (x, y, theta))):
        position = {"x": x, "y": y, "theta": wrap_scalar(theta), "mapId": map_id}
        position["localized" if version is StateVersion.V3 else "positionInitialized"] = localized
        position |= {"deviationRange": deviation} if math.isfinite(deviation) else {}
    errors = [] if localized else [{"errorType": ERROR, "errorDescription": WHY[mode], "errorLevel": "FATAL"}]
    return {
        "headerId": header,
        "timestamp": timestamp(stamp_ns, version),
        **_unknown(version),
        **({"mobileRobotPosition" if version is StateVersion.V3 else "agvPosition": position} if position else {}),
        "errors": errors,
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class StateFile:
    """Where state messages go while a vehicle drives, and what they say of the map."""

    path: Path
    """A file that does not exist."""
    map_id: str | None = None
    """Identification of the map, as the orders have it; None: the project's name."""
    version: StateVersion = StateVersion.V2
    """Of the messages."""


class StateStream:
    """State messages that are written while a vehicle drives, as those of the finished run; called by one thread.

    Parameters
    ----------
    given : the file, which is made now.
    project_name : what the map is called where nothing else is said.

    Raises
    ------
    UsageError
        the file exists: messages are never overwritten.
    FileFormatError
        it cannot be written.
    """

    def __init__(self, given: StateFile, project_name: str) -> None:
        try:
            self._file = given.path.open("xb", buffering=0)
        except FileExistsError:
            raise UsageError(f"{given.path} exists; expected a new file for the state messages") from None
        except OSError as error:
            raise cannot_write(given.path, error) from error
        self.path = given.path
        self._of = project_name if given.map_id is None else given.map_id, given.version
        self._count, self._mode, self._told_ns = 0, -1, 0

    def append(self, estimates: Iterable[Estimate], supervisor: SupervisorParameters) -> None:
        """Write what is to be told of the newest cycles; a full disk ends the messages and no more.

        Parameters
        ----------
        estimates : of the newest cycles, in their order.
        supervisor : by which the deviation is reckoned.
        """
        for estimate in estimates:
            if estimate.mode == self._mode and estimate.stamp_ns < self._told_ns + PERIOD_NS:
                continue
            belief = estimate.posterior
            deviation = float(position_two_sigma(belief.covariance[np.newaxis], supervisor)[0])
            head, pose = (self._count, int(estimate.stamp_ns)), (belief.mean, deviation)
            line = json.dumps(_message(head, estimate.mode, pose, self._of), ensure_ascii=False, allow_nan=False)
            try:
                self._file.write(line.encode() + b"\n")
            except (OSError, ValueError):
                log.exception("a state message")
                return
            self._count, self._mode, self._told_ns = self._count + 1, int(estimate.mode), int(estimate.stamp_ns)

    def close(self) -> None:
        """End the file."""
        self._file.close()


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
