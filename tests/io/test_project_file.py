from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from commission.errors import CommissionError, FileFormatError, UsageError
from commission.io.project_file import OpenedProject, apply_settings, load_project, open_project, save_project
from commission.site.disturbances import WheelNoise
from commission.site.floor_map import FloorMap
from commission.site.parameters import Parameters
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Route, Segment
from commission.site.stations import Station
from tests.io.projects import projects

MINIMAL = """\
schema: 1
name: Lost in the woods
reflectors: reflectors.csv
vehicle: {kind: differential, wheel_separation: 0.4}
scanner:
  mounting: [0.219, 0.0, 0.0]
  field_of_view_deg: [-90.0, 90.0]
  resolution_deg: 0.5
  rate: 10.0
  range: [0.05, 40.0]
routes:
  - name: Loop
    speed: 0.5
    segments:
      - {direction: forward, degree: 3, control_points: [[0, 0], [2, 0], [4, 1], [6, 1]]}
parameters:
  association: {gate_probability: 0.95}
"""


def write_project(folder: Path, text: str) -> Path:
    (folder / "reflectors.csv").write_text("id,x,y,radius\nA,1,2,0.04\n")
    (folder / "project.yaml").write_text(text)
    return folder


def test_minimal_project_has_its_values_and_defaults_elsewhere(tmp_path: Path) -> None:
    project = load_project(write_project(tmp_path, MINIMAL))
    assert project.name == "Lost in the woods"
    assert project.scanners[0].mounting.tolist() == [0.219, 0.0, 0.0]
    assert project.route("Loop").segments[0].control_points.tolist() == [[0, 0], [2, 0], [4, 1], [6, 1]]
    assert project.parameters == Parameters()
    assert project.floor_map is None


TWO = """\
schema: 2
scanners:
  - {name: front left, mounting: [0.4, 0.3, 0.8], stamp_of: last, sweep_direction: -1, sweep_duration: 0.03}
  - name: rear right
    upside_down: true
    blind_sectors_deg: [[-90, -60], [60, 90]]
"""


def test_noise_of_detections_is_each_scanner_s_own_or_none_and_none_is_not_written(tmp_path: Path) -> None:
    text = TWO + "    detection_range_sigma: 0.03\n    detection_bearing_sigma_deg: 0.4\n"
    project = load_project(write_project(tmp_path, text))
    front, rear = project.scanners
    assert (front.detection_range_sigma, front.detection_bearing_sigma_deg) == (None, None)
    assert (rear.detection_range_sigma, rear.detection_bearing_sigma_deg) == (0.03, 0.4)
    save_project(project, tmp_path)
    assert load_project(tmp_path).scanners == project.scanners
    written = (tmp_path / "project.yaml").read_text(encoding="utf-8")
    assert [written.count(f"\n    detection_{each}") for each in ("range_sigma", "bearing_sigma_deg")] == [1, 1]


@pytest.mark.parametrize("key", ["detection_range_sigma", "detection_bearing_sigma_deg"])
def test_noise_of_detections_is_more_than_zero(tmp_path: Path, key: str) -> None:
    with pytest.raises(FileFormatError, match=f"{key}: is 0; expected more than 0"):
        load_project(write_project(tmp_path, f"{TWO}    {key}: 0\n"))


def test_detection_rates_are_kept_as_they_are_and_empty_where_they_are(tmp_path: Path) -> None:
    project = load_project(write_project(tmp_path, TWO + "    detection_rates: [[5, 0.8], [15.5, 0.12]]\n"))
    assert [each.detection_rates for each in project.scanners] == [(), ((5.0, 0.8), (15.5, 0.12))]
    save_project(project, tmp_path)
    assert load_project(tmp_path).scanners == project.scanners
    written = (tmp_path / "project.yaml").read_text(encoding="utf-8")
    assert written.count("detection_rates: []") == 1
    assert "detection_rates: [[5.0, 0.8], [15.5, 0.12]]" in written


def test_a_project_of_several_scanners_has_each_with_its_values(tmp_path: Path) -> None:
    front, rear = load_project(write_project(tmp_path, TWO)).scanners
    assert (front.name, front.stamp_of, front.sweep_direction, front.sweep_duration) == ("front left", "last", -1, 0.03)
    assert front.mounting.tolist() == [0.4, 0.3, 0.8]
    assert (rear.name, rear.upside_down) == ("rear right", True)
    assert rear.blind_sectors_deg == ((-90.0, -60.0), (60.0, 90.0))


def test_the_only_scanner_of_an_older_project_is_a_list_of_one(tmp_path: Path) -> None:
    (scanner,) = load_project(write_project(tmp_path, MINIMAL)).scanners
    assert (scanner.name, scanner.rate, scanner.sweep_duration) == ("scanner", 10.0, 0.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("schema: 2\nscanners: []\n", "scanners is empty; expected at least one"),
        ("schema: 3\n", "line 1, schema: is 3; expected 1 or 2, the versions this program knows"),
        (
            "schema: 2\nscanner: {rate: 5}\nscanners: [{rate: 5}]\n",
            "line 2, scanner: is given besides `scanners`; expected all scanners in the list `scanners`",
        ),
        (
            "schema: 2\nscanners: [{name: a}, {name: A}]\n",
            "scanner name 'A' is used twice; expected unique names",
        ),
        (
            "schema: 2\nscanners:\n  - name: a\n  - name: b/c\n",
            "line 4, scanners[1].name: is 'b/c'; expected 1 to 40 letters, digits, blanks (inside), - and _",
        ),
        ("schema: 2\nscanners:\n  - stamp_of: end\n", "stamp_of"),
        ("schema: 2\nscanners:\n  - sweep_direction: 0\n", "expected 1 (counter-clockwise) or -1 (clockwise)"),
        (
            "schema: 2\nscanners:\n  - {rate: 25, sweep_duration: 0.041}\n",
            "scanners[0].sweep_duration: is 0.041 s at 25 scans/s; expected no more than from one scan to the next",
        ),
        (
            "schema: 2\nscanners:\n  - {field_of_view_deg: [-90, 90], blind_sectors_deg: [[80, 100]]}\n",
            "holds [80, 100]; expected sectors inside of the field of view, -90 to 90 deg",
        ),
        (
            "schema: 2\nscanners:\n  - detection_rates: [[5, 80]]\n",
            "scanner.detection_rates holds [5, 80]; expected a distance [m], then a share of 0 to 1",
        ),
        ("schema: 2\nscanners:\n  - blind_sectors_deg: [[10, 5]]\n", "scanner.blind_sectors_deg holds [10, 5]"),
    ],
)
def test_scanners_that_cannot_be_are_refused(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(FileFormatError) as refused:
        load_project(write_project(tmp_path, text))
    assert message in str(refused.value)


def test_schema_alone_is_a_project(tmp_path: Path) -> None:
    (tmp_path / "project.yaml").write_text("schema: 1\n")
    assert load_project(tmp_path / "project.yaml") == Project()


@given(project=projects())
@settings(max_examples=40, suppress_health_check=[HealthCheck.too_slow])
def test_project_that_is_saved_and_loaded_again_is_equal_but_for_the_rounding_of_files(
    tmp_path_factory: pytest.TempPathFactory, project: Project
) -> None:
    folder = tmp_path_factory.mktemp("project")
    save_project(project, folder)
    loaded = load_project(folder)
    pairs = list(zip(leaves(loaded), leaves(project), strict=True))
    # Half a tenth of a millimetre, and half of the sixth digit.
    numbers = [(new, old) for new, old in pairs if isinstance(old, float)]
    assert all(math.isclose(new, old, rel_tol=5.001e-6, abs_tol=0.5001e-4) for new, old in numbers)
    others = [(new, old) for new, old in pairs if not isinstance(old, float)]
    assert all(new == old for new, old in others)
    sigmas = zip(leaves(loaded.parameters), leaves(project.parameters), strict=True)
    assert all(math.isclose(new, old, rel_tol=5.001e-6, abs_tol=0.0) for new, old in sigmas if isinstance(old, float))


@given(project=projects())
@settings(max_examples=25, suppress_health_check=[HealthCheck.too_slow])
def test_what_is_read_and_written_again_does_not_drift(
    tmp_path_factory: pytest.TempPathFactory, project: Project
) -> None:
    first, second = tmp_path_factory.mktemp("first"), tmp_path_factory.mktemp("second")
    save_project(project, first)
    loaded = load_project(first)
    save_project(loaded, second)
    assert {path.name: path.read_bytes() for path in first.iterdir()} == {
        path.name: path.read_bytes() for path in second.iterdir()
    }
    assert load_project(second) == loaded


def leaves(value: object) -> Iterator[object]:
    """Numbers and words of a value."""
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            if field.init:
                yield from leaves(getattr(value, field.name))
    elif isinstance(value, tuple | list | np.ndarray):
        for element in value.tolist() if isinstance(value, np.ndarray) else value:
            yield from leaves(element)
    else:
        yield value


def test_a_file_holds_no_digits_that_nobody_meant(tmp_path: Path) -> None:
    garbage = 5.640000000000006
    project = Project(
        reflectors=ReflectorMap((Reflector(id="a", x=garbage, y=-3e-17, heading=math.radians(30.0)),)),
        routes=(Route("Loop", (Segment(control_points=[[garbage, 0.1 + 0.2], [6, 0], [7, 0], [8, 0]]),)),),
        stations=(Station(name="Dock", x=garbage, y=1.0 / 3.0, heading=math.pi / 2.0),),
        floor_map=FloorMap(np.zeros((3, 3), np.int8), 0.1 / 2.0, [garbage, -0.30000000000000004, 0.0]),
    )
    save_project(project, tmp_path)
    assert (tmp_path / "reflectors.csv").read_text(
        encoding="utf-8"
    ) == "id,x,y,radius,heading\na,5.64,0.0,0.04,0.523599\n"
    written = "".join((tmp_path / name).read_text(encoding="utf-8") for name in ("project.yaml", "map.yaml"))
    assert "[[5.64, 0.3], [6.0, 0.0]" in written
    assert "y: 0.3333  # m" in written
    assert "heading: 1.570796  # rad" in written
    assert "origin: [5.64, -0.3, 0.0]" in written
    numbers = re.findall(r"-?\d+\.\d+(?:e-?\d+)?", written)
    assert max(len(number.lstrip("-0.")) for number in numbers) <= 8, numbers


@given(project=projects())
@settings(max_examples=15, suppress_health_check=[HealthCheck.too_slow])
def test_other_readers_of_yaml_see_the_same_numbers(tmp_path_factory: pytest.TempPathFactory, project: Project) -> None:
    folder = tmp_path_factory.mktemp("project")
    save_project(project, folder)
    document = yaml.safe_load((folder / "project.yaml").read_text(encoding="utf-8"))
    assert document["name"] == project.name
    assert document["parameters"]["odometry"] == dataclasses.asdict(load_project(folder).parameters.odometry)


def test_moving_one_reflector_changes_one_line_of_one_file(tmp_path: Path) -> None:
    reflectors = tuple(Reflector(id=str(i), x=float(i), y=0.0) for i in range(9))
    project = Project(reflectors=ReflectorMap(reflectors), floor_map=FloorMap(np.zeros((3, 3), np.int8), 0.1))
    save_project(project, tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    map_written = (tmp_path / "map.png").stat().st_mtime_ns
    moved = dataclasses.replace(reflectors[4], y=1.5)
    save_project(
        dataclasses.replace(project, reflectors=ReflectorMap((*reflectors[:4], moved, *reflectors[5:]))), tmp_path
    )
    after = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert [name for name in before if before[name] != after[name]] == ["reflectors.csv"]
    lines = zip(before["reflectors.csv"].splitlines(), after["reflectors.csv"].splitlines(), strict=True)
    assert sum(old != new for old, new in lines) == 1
    assert (tmp_path / "map.png").stat().st_mtime_ns == map_written


def test_saving_keeps_the_names_of_the_files_that_are_there(tmp_path: Path) -> None:
    (tmp_path / "project.yaml").write_text("schema: 1\nreflectors: tables/may.csv\n")
    (tmp_path / "tables").mkdir()
    (tmp_path / "tables/may.csv").write_text("id,x,y,radius\n")
    save_project(Project(reflectors=ReflectorMap((Reflector(id="A", x=1.0, y=2.0),))), tmp_path)
    assert (tmp_path / "tables/may.csv").read_text() == "id,x,y,radius\nA,1.0,2.0,0.04\n"
    assert len(load_project(tmp_path).reflectors) == 1


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("rate: 10.0", "rate: fast", "line 9, scanner.rate: is 'fast'; expected a number (Scans per second [scans/s])"),
        ("rate: 10.0", "rate: 0", "line 9, scanner.rate: is 0; expected 0.1 to 1000 scans/s"),
        (
            "rate: 10.0",
            "rte: 10",
            "line 9, scanner.rte: is no known key; expected one of: name, kind, mounting, upside_down",
        ),
        ("rate: 10.0", "rate: .inf", "line 9, scanner.rate: is .inf; expected a finite number"),
        ("rate: 10.0", "resolution_deg: 1", "line 9, scanner.resolution_deg: is given a second time"),
        (
            "[0.219, 0.0, 0.0]",
            "[0.2, left, 0]",
            "line 6, scanner.mounting: is [0.2, 'left', 0]; expected a list of num",
        ),
        ("[0.219, 0.0, 0.0]", "[0.2, 0]", "line 6, scanner.mounting: has shape (2,); expected (3)"),
        ("[-90.0, 90.0]", "[90.0]", "line 7, scanner.field_of_view_deg: is [90.0]; expected a list of length 2"),
        (
            "kind: differential",
            "kind: boat",
            "vehicle.kind: is 'boat'; expected one of: differential, tricycle, omnidir",
        ),
        ("wheel_separation", "wheelbase", "vehicle.wheelbase: is no known key; expected one of: wheel_separation"),
        ("separation: 0.4", "separation: -1", "line 4, vehicle.wheel_separation: is -1; expected more than 0 m"),
        ("forward", "sideways", "routes[0].segments[0].direction: value 'sideways'; expected one of: forward, reverse"),
        ("degree: 3", "degree: 9", "line 15, routes[0].segments[0]: 4 control points; expected at least 10"),
        ("name: Loop", "label: Loop", "routes[0].label: is no known key; expected one of: name, segments, speed"),
        ("  - name: Loop\n    speed", "  - speed", "line 12, routes[0].name: is missing"),
        ("0.95", "1.5", "parameters.association.gate_probability: is 1.5; expected more than 0 and less than 1"),
        ("schema: 1", "schema: 7", "line 1, schema: is 7; expected 1"),
        ("schema: 1", "title: x", "schema: is missing"),
        ("reflectors.csv", "../reflectors.csv", "line 3, reflectors: '../reflectors.csv' leads out of the folder"),
        ("reflectors.csv", "/etc/hostname", "line 3, reflectors: '/etc/hostname' leads out of the folder"),
        ("reflectors.csv", "absent.csv", "absent.csv: does not exist"),
        ("name: Lost in the woods", "name: [1, 2]", "line 2, name: is [1, 2]; expected text"),
        ("name: Lost in the woods", "name: &a x", "uses an anchor or alias"),
        ("name: Lost in the woods", "name: !!python/name:os.system x", "has the tag"),
        ("name: Lost in the woods", "name: 'x", "is no YAML"),
        ("{gate_probability: 0.95}", "0.95", "parameters.association: is 0.95; expected a mapping"),
        ("[2, 0]", "[2, 1e8]", "routes[0].segments[0].control_points[1][1]: is 1e+08; expected -1e+07 to 1e+07 m"),
        (
            "speed: 0.5",
            "speed: 1e-9",
            "line 13, routes[0].speed: is 1e-09; expected 0.001 to 100 m/s",
        ),
        (
            "schema: 1",
            "schema: 1\ndisturbances: {people: 99999}",
            "line 2, disturbances.people: is 99999; expected 0 to 10000",
        ),
        (
            "[0.05, 40.0]",
            "[0.05, 1e8]",
            "line 10, scanner.range[1]: is 1e+08; expected 0 to 10000 m",
        ),
    ],
)
def test_wrong_project_is_one_line_with_place_found_and_expected(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    assert old in MINIMAL
    with pytest.raises(FileFormatError) as caught:
        load_project(write_project(tmp_path, MINIMAL.replace(old, new, 1)))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_two_routes_of_one_name_are_refused(tmp_path: Path) -> None:
    route = MINIMAL[MINIMAL.index("  - name: Loop") : MINIMAL.index("parameters:")]
    with pytest.raises(FileFormatError, match="route name 'Loop' is used twice"):
        load_project(write_project(tmp_path, MINIMAL.replace(route, route * 2)))


def test_link_that_leads_out_of_the_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "inner").mkdir()
    write_project(tmp_path / "inner", MINIMAL)
    (tmp_path / "outer.csv").write_text("id,x,y,radius\n")
    (tmp_path / "inner/reflectors.csv").unlink()
    (tmp_path / "inner/reflectors.csv").symlink_to(tmp_path / "outer.csv")
    with pytest.raises(FileFormatError, match="leads out of the folder"):
        load_project(tmp_path / "inner")


@pytest.mark.parametrize(
    "text", ["[" * 100_000, "{a: " * 100_000, "- " * 100_000, "a: " + "9" * 100_000, "schema: 1\n" * 2]
)
def test_hostile_yaml_is_one_line(tmp_path: Path, text: str) -> None:
    with pytest.raises(FileFormatError):
        load_project(write_project(tmp_path, text))


def test_huge_file_is_refused_before_it_is_read(tmp_path: Path) -> None:
    with (tmp_path / "project.yaml").open("wb") as file:
        file.truncate(10**12)
    with pytest.raises(FileFormatError, match="has 1000000000000 bytes"):
        load_project(tmp_path)


@given(data=st.data())
@settings(max_examples=200)
def test_mutated_project_is_one_line_or_a_project(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    text = list(MINIMAL)
    for _ in range(data.draw(st.integers(1, 5))):
        position = data.draw(st.integers(0, len(text) - 1))
        text[position] = data.draw(st.sampled_from(list("[]{}:,-#&*!|>'\"%@`0.e\n\t ax\u00e9\x00")) | st.just(""))
    try:
        load_project(write_project(tmp_path_factory.mktemp("project"), "".join(text)))
    except CommissionError as error:
        assert "\n" not in str(error)


@given(tree=st.recursive(st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5), st.lists))
@pytest.mark.parametrize(
    "key", ["name", "floor_map", "reflectors", "vehicle", "scanner", "scanners", "routes", "parameters"]
)
def test_any_value_under_any_key_is_one_line_or_a_project(
    tmp_path_factory: pytest.TempPathFactory, key: str, tree: object
) -> None:
    folder = tmp_path_factory.mktemp("project")
    (folder / "project.yaml").write_text(yaml.safe_dump({"schema": 1, key: tree}), encoding="utf-8")
    try:
        load_project(folder)
    except CommissionError as error:
        assert "\n" not in str(error)


def test_settings_change_the_named_parameters_only() -> None:
    changed = apply_settings(Parameters(), ["observation.range_sigma=6e-2", "detector.enabled = false"])
    assert changed.observation.range_sigma == 0.06
    assert not changed.detector.enabled
    assert changed.supervisor == Parameters().supervisor


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("range_sigma", "'range_sigma' is no group.key=value"),
        (
            "observations.range_sigma=1",
            "no parameter is called 'observations.range_sigma'; expected one of: observation, odometry",
        ),
        (
            "observation.sigma=1",
            "no parameter is called 'observation.sigma'; expected one of: observation.range_sigma, ",
        ),
        ("observation.range_sigma=wide", "observation.range_sigma is 'wide'; expected a number"),
        ("observation.range_sigma=nan", "observation.range_sigma is 'nan'; expected a number"),
        ("observation.range_sigma=-1", "observation.range_sigma is -1; expected more than 0 m"),
        ("detector.min_model_error=1.5", "detector.min_model_error is 1.5; expected a whole number"),
        ("detector.enabled=perhaps", "detector.enabled is 'perhaps'; expected true or false"),
    ],
)
def test_wrong_setting_says_what_is_known(setting: str, message: str) -> None:
    with pytest.raises(UsageError) as caught:
        apply_settings(Parameters(), [setting])
    assert message in str(caught.value)


@pytest.mark.parametrize("name", ["Halle 3", "Halle 3/project.yaml"])
def test_a_folder_without_a_project_begins_an_empty_one_of_its_name(tmp_path: Path, name: str) -> None:
    opened = open_project(tmp_path / name)
    assert opened == OpenedProject(Project(name="Halle 3"), tmp_path / "Halle 3", is_new=True)
    assert list(tmp_path.iterdir()) == []
    save_project(opened.project, opened.folder)
    assert open_project(tmp_path / name) == replace(opened, is_new=False)


def test_a_broken_project_is_not_taken_for_a_new_one(tmp_path: Path) -> None:
    (tmp_path / "project.yaml").write_text("schema: 99\n")
    with pytest.raises(FileFormatError, match="schema: is 99"):
        open_project(tmp_path)
    (tmp_path / "project.yaml").unlink()
    (tmp_path / "project.yaml").mkdir()
    with pytest.raises(FileFormatError):
        open_project(tmp_path)


def test_a_map_that_is_referred_to_by_a_detour_is_saved_where_it_is(tmp_path):
    folder = tmp_path / "hall"
    save_project(Project(name="Hall", floor_map=FloorMap(np.zeros((3, 4), np.int8), 0.1)), folder)
    text = (folder / "project.yaml").read_text(encoding="utf-8")
    (folder / "project.yaml").write_text(text.replace("floor_map: map.yaml", "floor_map: ../hall/map.yaml"))
    project = load_project(folder)
    changed = dataclasses.replace(project, floor_map=FloorMap(np.zeros((5, 4), np.int8), 0.1))
    save_project(changed, folder)
    assert load_project(folder) == changed
    assert sorted(path.name for path in folder.iterdir()) == ["map.png", "map.yaml", "project.yaml", "reflectors.csv"]


def test_a_save_for_which_there_is_no_space_writes_no_file_at_all(tmp_path, monkeypatch):
    project = Project(name="Hall", floor_map=FloorMap(np.zeros((3, 4), np.int8), 0.1))
    save_project(project, tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    def no_space(*_arguments):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("commission.io.project_file.project_text", no_space)
    changed = dataclasses.replace(project, floor_map=FloorMap(np.zeros((5, 4), np.int8), 0.1))
    with pytest.raises(FileFormatError, match="No space left on device"):
        save_project(changed, tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    with pytest.raises(FileFormatError, match="No space left on device"):
        save_project(changed, tmp_path / "copy" / "of it")
    assert not (tmp_path / "copy").exists()


OLD = """schema: 1
parameters:
  odometry: {forward_per_sqrt_m: 0.05, lateral_per_sqrt_m: 0.04, heading_per_sqrt_m: 0.03, heading_per_sqrt_rad: 0.02,
             forward_per_sqrt_s: 0.01, heading_per_sqrt_s: 0.005}
"""
"""A project of the time when the filter's parameters were the true noise of the wheels, too."""


@pytest.mark.parametrize("disturbances", ["", "disturbances: {people: 3}\n"])
def test_wheels_of_an_old_project_are_those_that_its_parameters_gave_and_stay_so(
    tmp_path: Path, disturbances: str
) -> None:
    (tmp_path / "project.yaml").write_text(OLD + disturbances)
    project = load_project(tmp_path)
    assert dataclasses.astuple(project.disturbances.wheels) == (0.05, 0.04, 0.03, 0.02, 0.01, 0.005)
    assert project.disturbances.people == (3 if "3" in disturbances else 0)
    tuned = dataclasses.replace(project, parameters=Parameters())
    save_project(tuned, tmp_path)
    assert load_project(tmp_path) == tuned


def test_wheels_that_a_project_states_are_not_those_of_its_parameters(tmp_path: Path) -> None:
    (tmp_path / "project.yaml").write_text(OLD + "disturbances: {wheels: {lateral_per_sqrt_m: 0.001}}\n")
    assert load_project(tmp_path).disturbances.wheels == WheelNoise(lateral_per_sqrt_m=0.001)
