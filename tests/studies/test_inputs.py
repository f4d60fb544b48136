"""Inputs of studies are their own keys: whatever changes a result changes the input, and nothing else can be read."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np
import pytest

from commission.errors import ProjectError, UsageError
from commission.planning.ambiguity import AmbiguityOptions
from commission.planning.dependence import Failure
from commission.planning.dilution import Heading, Measurement
from commission.planning.placement import PlacementOptions
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.layout_brief import CandidateOptions, Demands
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Route, Segment
from commission.site.scanner import Scanner
from commission.site.stations import Station
from commission.studies.ambiguity import AmbiguityInput, ambiguity, misleading_neighbors
from commission.studies.coverage import CoverageInput, CoverageOptions, coverage
from commission.studies.drives import DrivesInput
from commission.studies.failures import FailuresInput, failures
from commission.studies.inputs import StudyInput, is_same
from commission.studies.placement import PlacementInput, placement
from commission.studies.plausibility import PlausibilityInput, plausibility
from commission.studies.prediction import PredictionInput, prediction
from commission.studies.problems import ProblemsInput, problems
from commission.studies.profiles import ProfilesInput, profiles
from commission.studies.run import RunInput, judged_run
from commission.studies.start import start_of
from tests.conftest import few_of
from tests.studies.recorded import scan_log

ROUTE = "Line"


def hall() -> FloorMap:
    """10 x 6 m with a wall around it and a pillar."""
    cells = np.full((60, 100), FREE, dtype=np.int8)
    cells[:2], cells[-2:], cells[:, :2], cells[:, -2:] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    cells[40:44, 50:54] = OCCUPIED
    return FloorMap(cells, 0.1)


def line(y: float, name: str = ROUTE) -> Route:
    return Route(name, (Segment(control_points=np.array([[2.0, y], [8.0, y]]), degree=1),))


PLACES = ((0.3, 3.1), (3.0, 5.6), (3.07, 5.6), (7.2, 5.6), (9.6, 2.0), (5.5, 0.4))
SITE = Project(
    floor_map=hall(),
    reflectors=ReflectorMap(tuple(Reflector(id=f"R{i}", x=x, y=y) for i, (x, y) in enumerate(PLACES))),
    scanners=(Scanner(field_of_view_deg=(-150.0, 150.0), reflector_range=20.0),),
    routes=(line(2.0),),
    stations=(Station(name="Dock", x=7.5, y=2.0),),
)
OPEN = replace(SITE, floor_map=None)
"""Without a map the routes say how far the floor reaches."""


def drive() -> RecordLog:
    """Two metres along the route, with three reflectors in sight; of one the range is wrong by more and more."""
    poses = np.column_stack([np.linspace(2.0, 4.0, 21), np.full(21, 2.0), np.zeros(21)])
    stamps = np.arange(21) * 100_000_000
    offsets = np.array(PLACES[3:6])[None] - poses[1:, None, :2]
    seen = np.stack([np.hypot(offsets[..., 0], offsets[..., 1]), np.arctan2(offsets[..., 1], offsets[..., 0])], axis=2)
    seen[:, 2, 0] += np.linspace(0.0, 0.3, 20)
    return RecordLog(
        odometry_stamps_ns=stamps,
        displacements=np.concatenate([np.zeros((1, 3)), np.diff(poses, axis=0)]),
        detection_stamps_ns=stamps[1:],
        detection_offsets=3 * np.arange(21),
        range_bearing=seen.reshape(-1, 2),
        reference_stamps_ns=stamps,
        reference_poses=poses,
    )


DRIVE = drive()
SCANNED = replace(DRIVE, scans=(scan_log(np.full((20, 601), 5000.0)),))
START = start_of(SITE, DRIVE, (2.0, 2.0, 0.0))
GIVEN = CoverageOptions(heading=Heading.GIVEN, measurement=Measurement.RANGE_BEARING_PRIOR, spacing=0.5)
FEW = PlacementOptions(
    demands=Demands(visible=2, survive_failure=False), candidates=CandidateOptions(spacing=2.0), checks=5
)


@dataclass(frozen=True)
class Study:
    """A study, how its input is made, and what of its result is a figure."""

    name: str
    of: Callable[[Project], Any]
    run: Callable[[Any], object]
    site: Project = SITE

    def figures(self, project: Project) -> object:
        return self.run(self.of(project))


def _all(*values: Any) -> tuple[bytes, ...]:
    return tuple(np.asarray(value).tobytes() for value in values)


def _covered(inputs: CoverageInput) -> object:
    found = coverage(inputs)
    return _all(*found.coverage.fixes, found.drivable, found.coverage.lattice.points())


def _predicted(inputs: PredictionInput) -> object:
    found = prediction(inputs)
    said = found.prediction
    risks = [(risk.reflector, risk.neighbor, risk.probability.tobytes()) for risk in found.risks]
    return (_all(said.covariances, said.modes, said.limit_share, found.errors.squares), found.stations, risks)


def _ranked(inputs: FailuresInput) -> object:
    found = failures(inputs).ranking
    return [(each.reflector, each.limit_share, [part.metres.tolist() for part in each.routes]) for each in found]


def _ambiguous(inputs: AmbiguityInput) -> object:
    found = ambiguity(inputs)
    return _all(found.share, found.visible, found.partners, found.drivable)


def _misled(inputs: DrivesInput) -> object:
    return [[risk.probability.tobytes() for risk in each.risks] for each in misleading_neighbors(inputs)]


def _placed(inputs: PlacementInput) -> object:
    found = placement(inputs)
    return found.placement.reflectors, [(each.reason, each.first, each.last) for each in found.unmet]


def _checked(inputs: ProblemsInput) -> object:
    return [problem.text for problem in problems(inputs).problems]


def _looked_along(inputs: ProfilesInput) -> object:
    return [_all(*_arrays(profile)) for profile in profiles(inputs).profiles]


def _run(inputs: RunInput) -> object:
    found = judged_run(inputs)
    figures = _all(found.columns.means, found.columns.covariances, found.columns.modes, found.columns.status, found.nis)
    return figures, found.statistics, found.episodes


def _implausible(inputs: PlausibilityInput) -> object:
    return [str(finding) for finding in plausibility(inputs)]


def _arrays(value: Any) -> list[Any]:
    names = value._fields if hasattr(value, "_fields") else [field.name for field in dataclasses.fields(value)]
    return [getattr(value, name) for name in names if isinstance(getattr(value, name), float | np.ndarray)]


STUDIES = (
    Study("coverage", lambda site: CoverageInput.of(site, GIVEN), _covered),
    Study("coverage without a map", CoverageInput.of, _covered, OPEN),
    Study("prediction", lambda site: PredictionInput.of(site, ROUTE), _predicted),
    Study("failures", lambda site: FailuresInput.of(site, Failure.MOVED), _ranked),
    Study("ambiguity", lambda site: AmbiguityInput.of(site, AmbiguityOptions(headings=2), spacing=1.0), _ambiguous),
    Study("ambiguity without a map", lambda site: AmbiguityInput.of(site, spacing=2.0), _ambiguous, OPEN),
    Study("neighbors", lambda site: DrivesInput.of(site, (ROUTE,)), _misled),
    Study("placement", lambda site: PlacementInput.of(site, FEW), _placed),
    Study("problems", ProblemsInput.of, _checked),
    Study("run", lambda site: RunInput.of(site, DRIVE, START), _run),
    Study("plausibility", lambda site: PlausibilityInput.of(site, SCANNED), _implausible),
    Study("profiles", lambda site: ProfilesInput.of(site, (ROUTE,)), _looked_along),
)
EDITED = few_of(
    STUDIES, [each for each in STUDIES if each.name != "placement" and not each.name.endswith("without a map")]
)
"""Those of which every edit is tried."""


def others(value: Any) -> Iterator[tuple[str, Any]]:
    """Values that differ from one in a single leaf, each with the path to it."""
    match value:
        case bool():
            yield "", not value
        case Enum():
            yield "", next(each for each in type(value) if each is not value)
        case int():
            yield from (("", value + step) for step in (1, -1, 2))
        case float():
            yield from (("", each) for each in (value + 1.0, 0.9 * value, 1.02 * value + 1e-3) if each != value)
        case str():
            yield "", f"{value}x"
        case np.ndarray():
            yield from _other_arrays(value)
        case FloorMap():
            yield "", FloorMap(np.roll(value.cells, 3, axis=1), value.resolution)
        case tuple():
            if value and not isinstance(value[-1], int | float):  # a pair is no list
                yield "[fewer]", value[:-1]
            for index, each in enumerate(value):
                for path, other in others(each):
                    yield f"[{index}]{path}", (*value[:index], other, *value[index + 1 :])
        case _ if dataclasses.is_dataclass(value):
            yield from _with_other_fields(value)


def _other_arrays(value: np.ndarray) -> Iterator[tuple[str, Any]]:
    # Of an empty array, such as the tags of a drive that sees none, there is no other of its kind.
    if value.size:
        yield "", np.char.add(value, "x") if value.dtype.kind == "U" else value + 0.1


def _with_other_fields(value: Any) -> Iterator[tuple[str, Any]]:
    for field in dataclasses.fields(value):
        if field.init:
            for path, other in others(getattr(value, field.name)):
                with contextlib.suppress(
                    ProjectError, ValueError, TypeError, LookupError
                ):  # out of range, or of another shape
                    yield f".{field.name}{path}", replace(value, **{field.name: other})


def edits(site: Project) -> Iterator[tuple[str, Project]]:
    """Projects that differ from one in a single value; those of maps, routes and reflectors are a few of many."""
    yield ".floor_map", replace(site, floor_map=None)
    yield ".routes[more]", replace(site, routes=(*site.routes, line(9.0, "Other")))
    for path, other in others(site):
        if not path.startswith((".reflectors.reflectors[1]", ".reflectors.reflectors[2]", ".reflectors.reflectors[3]")):
            yield path, other


@pytest.mark.parametrize("study", EDITED, ids=lambda study: study.name)
def test_whatever_edit_changes_a_result_changes_the_input(study: Study) -> None:
    base, before = study.of(study.site), study.figures(study.site)
    assert study.of(study.site) == base
    known, changing = SEEN.get(study.name, ()), set[str]()
    for path, project in edits(study.site):
        try:
            inputs = study.of(project)
        except UsageError:  # nothing is left that could be asked about
            continue
        # Where the input is another one, what comes of it proves nothing.
        if (inputs == base or path in known) and study.run(inputs) != before:
            changing.add(path)
            assert inputs != base, f"{path} changes the result of {study.name} and not its input"
    for path in known:
        assert path in changing, f"{path} should change the result of {study.name}"


SEEN = {
    "coverage": (
        ".floor_map",
        ".parameters.observation.range_sigma",
        ".scanners[0].mounting",
        ".reflectors.reflectors[fewer]",
        ".parameters.odometry.forward_per_sqrt_m",
    ),
    "coverage without a map": (".routes[more]",),
    "prediction": (
        ".parameters.supervisor.position_limit",
        ".parameters.association.gate_probability",
        ".parameters.odometry.heading_per_sqrt_m",
        ".stations[fewer]",
        ".floor_map",
        ".scanners[0].range_sigma",
    ),
    "run": (
        ".parameters.observation.range_sigma",
        ".parameters.odometry.heading_per_sqrt_m",
        ".parameters.association.gate_probability",
        ".scanners[0].mounting",
        ".reflectors.reflectors[4].x",
        ".reflectors.reflectors[fewer]",
    ),
    "failures": (".parameters.supervisor.position_limit", ".parameters.odometry.heading_per_sqrt_m"),
    "problems": (".parameters.supervisor.position_limit", ".stations[0].x", ".vehicle.outline[fewer]"),
}
"""Edits that are known to matter: the test above would say nothing if it tried none of these."""


def parts_of(inputs: StudyInput, prefix: str = "") -> Iterator[tuple[str, StudyInput, str]]:
    """Each part of an input, those of inputs inside it included: its path, what holds it, and its name there."""
    for field in dataclasses.fields(inputs):  # type: ignore[arg-type]
        value = getattr(inputs, field.name)
        if isinstance(value, StudyInput):
            yield from parts_of(value, f"{prefix}{field.name}.")
        else:
            yield f"{prefix}{field.name}", inputs, field.name


def with_part(inputs: Any, path: str, value: object) -> Any:
    first, _, rest = path.partition(".")
    return replace(inputs, **{first: with_part(getattr(inputs, first), rest, value) if rest else value})


def lacking(inputs: Any, path: str) -> Any:
    """The same input without one of its parts."""
    first, _, rest = path.partition(".")
    bare = object.__new__(type(inputs))
    for field in dataclasses.fields(inputs):
        if field.name != first:
            object.__setattr__(bare, field.name, getattr(inputs, field.name))
        elif rest:
            object.__setattr__(bare, field.name, lacking(getattr(inputs, field.name), rest))
    return bare


@pytest.mark.parametrize("study", STUDIES, ids=lambda study: study.name)
def test_a_change_of_any_single_part_makes_another_input(study: Study) -> None:
    inputs = study.of(study.site)
    for path, holder, name in parts_of(inputs):
        value = getattr(holder, name)
        for _, other in list(others(value)) if value is not None else [("", 0.5)]:
            changed = with_part(inputs, path, other)
            assert changed != inputs, f"{path} of {study.name}"
            assert with_part(changed, path, value) == inputs
            assert hash(with_part(changed, path, value)) == hash(inputs)


@pytest.mark.parametrize("study", STUDIES, ids=lambda study: study.name)
def test_a_study_cannot_read_what_its_input_lacks_and_reads_all_that_it_has(study: Study) -> None:
    inputs = study.of(study.site)
    for path, _, _ in parts_of(inputs):
        if study.name in ("coverage", "ambiguity") and path == "routes":
            assert inputs.routes == (), "a map says how far the floor reaches, and routes do not count"
            continue
        with pytest.raises(AttributeError):
            study.run(lacking(inputs, path))


@pytest.mark.parametrize("study", STUDIES, ids=lambda study: study.name)
def test_an_input_holds_no_project(study: Study) -> None:
    inputs = study.of(study.site)
    assert not any(isinstance(getattr(holder, name), Project) for _, holder, name in parts_of(inputs))
    with pytest.raises(AttributeError):
        _ = inputs.disturbances


def test_plain_values_are_the_same_by_value_and_arrays_by_identity() -> None:
    array = np.zeros(2)
    assert is_same((1.0, "a", None), (1.0, "a", None))
    assert is_same(SITE.parameters, replace(SITE.parameters))
    assert is_same((array,), (array,))
    assert not is_same(array, array.copy())
    assert not is_same(1, 1.0)
    assert not is_same(True, 1)
    assert not is_same((1,), (1, 2))
    assert not is_same(Failure.BLOCKED, "blocked")
    assert not is_same(hall(), hall())
    one = hall()
    assert is_same(replace(SITE, floor_map=one), replace(SITE, floor_map=one))
