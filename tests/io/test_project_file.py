from __future__ import annotations

import dataclasses
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from commission.errors import CommissionError, FileFormatError, UsageError
from commission.io.project_file import OpenedProject, apply_settings, load_project, open_project, save_project
from commission.site.floor_map import FloorMap
from commission.site.parameters import Parameters
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
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
    assert project.scanner.mounting.tolist() == [0.219, 0.0, 0.0]
    assert project.route("Loop").segments[0].control_points.tolist() == [[0, 0], [2, 0], [4, 1], [6, 1]]
    assert project.parameters == Parameters()
    assert project.floor_map is None


def test_schema_alone_is_a_project(tmp_path: Path) -> None:
    (tmp_path / "project.yaml").write_text("schema: 1\n")
    assert load_project(tmp_path / "project.yaml") == Project()


@given(project=projects())
@settings(max_examples=40, suppress_health_check=[HealthCheck.too_slow])
def test_project_that_is_saved_and_loaded_again_is_equal(
    tmp_path_factory: pytest.TempPathFactory, project: Project
) -> None:
    folder = tmp_path_factory.mktemp("project")
    save_project(project, folder)
    assert load_project(folder) == project


@given(project=projects())
@settings(max_examples=15, suppress_health_check=[HealthCheck.too_slow])
def test_other_readers_of_yaml_see_the_same_numbers(tmp_path_factory: pytest.TempPathFactory, project: Project) -> None:
    folder = tmp_path_factory.mktemp("project")
    save_project(project, folder)
    document = yaml.safe_load((folder / "project.yaml").read_text(encoding="utf-8"))
    assert document["name"] == project.name
    assert document["parameters"]["odometry"] == dataclasses.asdict(project.parameters.odometry)


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
        ("rate: 10.0", "rte: 10", "line 9, scanner.rte: is no known key; expected one of: mounting, field_of_view_deg"),
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
@pytest.mark.parametrize("key", ["name", "floor_map", "reflectors", "vehicle", "scanner", "routes", "parameters"])
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
