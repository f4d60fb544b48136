"""State messages of VDA 5050: against lines written by hand from the schemas of 2.1.0 and 3.0.0."""

from __future__ import annotations

import json
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from commission.io.vda5050_states import StateVersion, state_messages, timestamp, told_cycles, write_states
from commission.localization.estimate import Mode
from commission.studies.run import RunResult

NOON_NS = 1_700_000_000_000_000_000
"""2023-11-14 22:13:20 UTC."""
MODES = (Mode.INITIALIZING, Mode.FAIL, Mode.OPERATIONAL, Mode.OPERATIONAL, Mode.OPERATIONAL, Mode.LOST)
STAMPS_MS = (0, 400, 999, 1500, 1999, 2125)

EXPECTED_2 = """\
{"headerId": 0, "timestamp": "2023-11-14T22:13:20.00Z", "version": "2.1.0", "manufacturer": "commission", \
"serialNumber": "localizer", "orderId": "", "orderUpdateId": 0, "lastNodeId": "", "lastNodeSequenceId": 0, \
"nodeStates": [], "edgeStates": [], "driving": false, "actionStates": [], "batteryState": {"batteryCharge": 100.0, \
"charging": false}, "operatingMode": "AUTOMATIC", "safetyState": {"eStop": "NONE", "fieldViolation": false}, \
"agvPosition": {"x": 0.0, "y": 0.5, "theta": 0.25, "mapId": "hall", "positionInitialized": false, \
"deviationRange": 20.0}, "errors": [{"errorType": "LOCALIZATION_ERROR", "errorDescription": \
"the vehicle is looking for where it is", "errorLevel": "FATAL"}]}
{"headerId": 1, "timestamp": "2023-11-14T22:13:20.40Z", "version": "2.1.0", "manufacturer": "commission", \
"serialNumber": "localizer", "orderId": "", "orderUpdateId": 0, "lastNodeId": "", "lastNodeSequenceId": 0, \
"nodeStates": [], "edgeStates": [], "driving": false, "actionStates": [], "batteryState": {"batteryCharge": 100.0, \
"charging": false}, "operatingMode": "AUTOMATIC", "safetyState": {"eStop": "NONE", "fieldViolation": false}, \
"agvPosition": {"x": 1.0, "y": 0.5, "theta": 0.25, "mapId": "hall", "positionInitialized": false}, \
"errors": [{"errorType": "LOCALIZATION_ERROR", "errorDescription": \
"the position is too uncertain, or nothing confirms it yet", "errorLevel": "FATAL"}]}
{"headerId": 2, "timestamp": "2023-11-14T22:13:20.99Z", "version": "2.1.0", "manufacturer": "commission", \
"serialNumber": "localizer", "orderId": "", "orderUpdateId": 0, "lastNodeId": "", "lastNodeSequenceId": 0, \
"nodeStates": [], "edgeStates": [], "driving": false, "actionStates": [], "batteryState": {"batteryCharge": 100.0, \
"charging": false}, "operatingMode": "AUTOMATIC", "safetyState": {"eStop": "NONE", "fieldViolation": false}, \
"agvPosition": {"x": 2.0, "y": 0.5, "theta": 0.25, "mapId": "hall", "positionInitialized": true, \
"deviationRange": 0.03}, "errors": []}
{"headerId": 3, "timestamp": "2023-11-14T22:13:21.99Z", "version": "2.1.0", "manufacturer": "commission", \
"serialNumber": "localizer", "orderId": "", "orderUpdateId": 0, "lastNodeId": "", "lastNodeSequenceId": 0, \
"nodeStates": [], "edgeStates": [], "driving": false, "actionStates": [], "batteryState": {"batteryCharge": 100.0, \
"charging": false}, "operatingMode": "AUTOMATIC", "safetyState": {"eStop": "NONE", "fieldViolation": false}, \
"agvPosition": {"x": 4.0, "y": 0.5, "theta": 0.25, "mapId": "hall", "positionInitialized": true, \
"deviationRange": 0.05}, "errors": []}
{"headerId": 4, "timestamp": "2023-11-14T22:13:22.12Z", "version": "2.1.0", "manufacturer": "commission", \
"serialNumber": "localizer", "orderId": "", "orderUpdateId": 0, "lastNodeId": "", "lastNodeSequenceId": 0, \
"nodeStates": [], "edgeStates": [], "driving": false, "actionStates": [], "batteryState": {"batteryCharge": 100.0, \
"charging": false}, "operatingMode": "AUTOMATIC", "safetyState": {"eStop": "NONE", "fieldViolation": false}, \
"agvPosition": {"x": 5.0, "y": 0.5, "theta": 0.25, "mapId": "hall", "positionInitialized": false, \
"deviationRange": 0.06}, "errors": [{"errorType": "LOCALIZATION_ERROR", "errorDescription": \
"too many detections fit no reflector", "errorLevel": "FATAL"}]}
"""


def made_run() -> RunResult:
    """Six cycles, and what the messages read of them."""
    count = len(MODES)
    means = np.column_stack((np.arange(count, dtype=float), np.full(count, 0.5), np.full(count, 0.25)))
    columns = SimpleNamespace(
        stamps_ns=NOON_NS + 1_000_000 * np.array(STAMPS_MS), modes=np.array(MODES, dtype=np.int8), means=means
    )
    deviations = np.array([20.0, math.inf, 0.03, 0.04, 0.05, 0.06])
    return cast(RunResult, SimpleNamespace(columns=columns, position_two_sigma=deviations))


def test_the_messages_are_those_written_by_hand(tmp_path: Path) -> None:
    assert write_states(tmp_path / "states.jsonl", made_run(), "hall") == 5
    written = (tmp_path / "states.jsonl").read_text(encoding="utf-8").splitlines()
    assert [json.loads(line) for line in written] == [json.loads(line) for line in EXPECTED_2.splitlines()]


def test_newer_messages_say_localized_of_the_mobile_robot() -> None:
    old, new = (list(state_messages(made_run(), "hall", version)) for version in StateVersion)
    for before, after in zip(old, new, strict=True):
        position = before["agvPosition"]
        localized = position.pop("positionInitialized")
        assert after["mobileRobotPosition"] == position | {"localized": localized}
        assert after["errors"] == before["errors"]
        assert (after["errors"] == []) == localized
        assert after["version"] == "3.0.0"
    assert [each["timestamp"] for each in new][-1] == "2023-11-14T22:13:22.125Z"


@pytest.mark.parametrize("version", StateVersion)
def test_the_messages_have_all_that_the_schema_asks_for(shared_data: Path, version: StateVersion) -> None:
    folder = shared_data / "layouts" / "vda5050" / f"schemas_{version.value}" / "json_schemas"
    schema = json.loads((folder / "state.schema").read_text(encoding="utf-8"))
    for message in state_messages(made_run(), "hall", version):
        assert_fits(message, schema, schema)


@pytest.mark.parametrize("version", StateVersion)
@pytest.mark.parametrize(("column", "value"), [(0, math.nan), (1, math.inf), (2, math.nan)])
def test_a_position_that_is_no_number_is_left_out(
    shared_data: Path, tmp_path: Path, version: StateVersion, column: int, value: float
) -> None:
    folder = shared_data / "layouts" / "vda5050" / f"schemas_{version.value}" / "json_schemas"
    schema = json.loads((folder / "state.schema").read_text(encoding="utf-8"))
    run = made_run()
    run.columns.means[0, column] = value
    write_states(tmp_path / "states.jsonl", run, "hall", version)
    first, *others = (json.loads(each) for each in (tmp_path / "states.jsonl").read_text("utf-8").splitlines())
    assert first == {
        key: each for key, each in next(state_messages(made_run(), "hall", version)).items() if "Position" not in key
    }
    assert others == list(state_messages(made_run(), "hall", version))[1:]
    assert_fits(first, schema, schema)


TYPES = {"object": dict, "array": list, "string": str, "number": float, "integer": int, "boolean": bool}


def assert_fits(value: Any, rule: dict[str, Any], schema: dict[str, Any]) -> None:
    """What of the JSON schema these messages need: types, required fields, enumerations and bounds."""
    if "$ref" in rule:
        rule = schema["definitions"][rule["$ref"].rpartition("/")[2]]
    if "type" in rule:
        assert isinstance(value, TYPES[rule["type"]]), (value, rule)
    assert set(rule.get("required", ())) <= set(value if isinstance(value, dict) else ())
    assert value in rule.get("enum", [value])
    if isinstance(value, float):
        assert rule.get("minimum", -math.inf) <= value <= rule.get("maximum", math.inf)
    if isinstance(value, dict):
        for key, inner in value.items():
            assert key in rule["properties"], key
            assert_fits(inner, rule["properties"][key], schema)
    if isinstance(value, list):
        for inner in value:
            assert_fits(inner, rule["items"], schema)


def test_a_message_comes_at_each_change_and_each_second() -> None:
    stamps = np.arange(0, 5_000_000_000, 250_000_000)
    modes = np.zeros(len(stamps), dtype=np.int64)
    assert told_cycles(stamps, modes).tolist() == [0, 4, 8, 12, 16]
    modes[5:7] = 2
    assert told_cycles(stamps, modes).tolist() == [0, 4, 5, 7, 11, 15, 19]
    assert told_cycles(stamps[:0], modes[:0]).tolist() == []
    # Scans farther apart than a second's share: the first one a second later.
    slow = np.arange(0, 4_000_000_000, 700_000_000)
    assert told_cycles(slow, np.zeros(len(slow), dtype=np.int64)).tolist() == [0, 2, 4]
    assert told_cycles(np.array([0, 9_000_000_000, 9_000_000_000]), modes[:3]).tolist() == [0, 1]


def test_a_stamp_before_its_next_hundredth_is_told_as_the_one_before() -> None:
    assert timestamp(0, StateVersion.V2) == "1970-01-01T00:00:00.00Z"
    assert timestamp(999_999_999, StateVersion.V2) == "1970-01-01T00:00:00.99Z"
    assert timestamp(999_999_999, StateVersion.V3) == "1970-01-01T00:00:00.999Z"
