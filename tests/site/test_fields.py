"""Fields by their dotted names: what is said about them, read and set; and every parameter is described."""

import dataclasses
import math
from enum import StrEnum
from typing import Annotated

import numpy as np
import pytest

from commission.errors import UsageError
from commission.site.checks import check_fields
from commission.site.disturbances import (
    ConstantErrors,
    CoveredPeriod,
    Disturbances,
    Reel,
    ScannerError,
    ShinyObject,
    TiltedStretch,
    WheelNoise,
)
from commission.site.fields import (
    field_info,
    fields_of,
    get_field,
    in_file,
    walk_fields,
    with_field,
)
from commission.site.layout_brief import AllowedHeights, CandidateOptions, Demands
from commission.site.parameters import AssociationParameters, Parameters
from commission.site.project import Project
from commission.site.quantity import NOT_NEGATIVE, Choice, Group, Quantity, Switch
from commission.site.reflectors import Reflector, ReflectorKind
from commission.site.routes import Route, Segment
from commission.site.scanner import Scanner
from commission.site.stations import Station
from commission.site.tags import Tag, TagCamera
from commission.site.vehicle import DifferentialVehicle, OmnidirectionalVehicle, TricycleVehicle

EDITED = (
    *(DifferentialVehicle, TricycleVehicle, OmnidirectionalVehicle, Scanner, Reflector, Station, Segment, Route),
    *(WheelNoise, ConstantErrors, ScannerError, Tag, TagCamera),
    *(Disturbances, ShinyObject, TiltedStretch, CoveredPeriod, Reel, Demands, CandidateOptions, AllowedHeights),
)
NO_QUANTITY = {"Segment.degree"}
"""Numbers that nobody sets: the degree belongs to the knots."""


def undescribed(cls: type) -> list[str]:
    """Dotted names of the numbers, switches and words of a value that say nothing of themselves."""
    return [name for name, info in walk_fields(cls) if not info.descriptions]


def test_every_parameter_says_its_label_unit_and_bounds_beside_its_field():
    assert undescribed(Parameters) == []
    for name, info in walk_fields(Parameters):
        if info.kind in (int, float):
            assert info.quantity is not None, name
            # Echo strength has each sensor's own unit: no two ends fit.
            assert (info.quantity.slider is None) == (name == "detector.intensity_threshold"), name
        elif info.kind is bool:
            assert isinstance(info.descriptions[0], Switch), name
        else:
            assert isinstance(info.descriptions[0], Choice), name
            assert info.options, name
    for name, info in fields_of(Parameters).items():
        assert isinstance(info.descriptions[0], Group), name


def test_a_parameter_without_a_description_is_found():
    @dataclasses.dataclass(frozen=True)
    class More(AssociationParameters):
        forgotten: float = 0.0

    @dataclasses.dataclass(frozen=True)
    class Larger:
        association: More = dataclasses.field(default_factory=More)

    assert undescribed(Larger) == ["association.forgotten"]


def test_every_number_that_the_engineer_edits_is_a_quantity():
    for cls in EDITED:
        for name, info in fields_of(cls).items():
            if info.kind in (int, float) and f"{cls.__name__}.{name}" not in NO_QUANTITY:
                assert info.quantity is not None, f"{cls.__name__}.{name}"


def test_the_unit_is_said_by_the_quantity_and_not_again_by_the_hint():
    for cls in (Parameters, *EDITED):
        for name, info in walk_fields(cls):
            assert "[" not in info.hint, f"{cls.__name__}.{name}: {info.hint}"


def test_help_of_a_field_names_its_unit_or_its_bounds():
    info = field_info(Parameters(), "observation.range_sigma")
    assert info.help == "1-sigma noise of a reflector's measured range [m]."
    assert field_info(Parameters(), "association.gate_probability").unit == "more than 0 and less than 1"
    assert field_info(Parameters(), "supervisor.recovery_ratio").unit == "1 or more"
    assert fields_of(Scanner)["mounting"].unit == "m, m, rad"
    assert fields_of(Scanner)["field_of_view_deg"].unit == "deg"
    assert fields_of(Disturbances)["dropped_scans"].unit == "0 to 1"
    assert fields_of(Disturbances)["people"].unit == fields_of(Disturbances)["glints_per_scan"].unit == ""


def test_a_field_is_read_and_set_by_its_dotted_name():
    project = Project()
    assert get_field(project, "parameters.association.gate_probability") == 0.95
    changed = with_field(project, "parameters.association.gate_probability", 0.9)
    assert changed.parameters.association.gate_probability == 0.9
    assert project.parameters.association.gate_probability == 0.95
    assert changed.parameters.observation is project.parameters.observation
    assert with_field(project, "vehicle.wheel_separation", 0.5).vehicle == DifferentialVehicle(wheel_separation=0.5)


def test_one_number_of_a_list_is_read_and_set_by_its_index():
    scanner = Scanner(mounting=[0.1, 0.2, 0.3])
    assert get_field(scanner, "mounting[2]") == 0.3
    turned = with_field(scanner, "mounting[2]", 0.5)
    assert turned.mounting.tolist() == [0.1, 0.2, 0.5]
    assert field_info(scanner, "mounting[2]").label == "Faces"
    assert field_info(scanner, "range[1]").quantity == fields_of(Scanner)["range"].descriptions[1]
    assert with_field(scanner, "range[1]", 12).range == (0.05, 12.0)
    moved = with_field(Project(vehicle=DifferentialVehicle()), "vehicle.outline[1][0]", -0.7)
    assert moved.vehicle.outline[1] == (-0.7, 0.3)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("association.gate", "no parameter is called 'association.gate'; expected one of: association.enabled, "),
        ("gate", "no parameter is called 'gate'; expected one of: observation, odometry"),
        ("", "no parameter is called ''; expected one of: observation"),
        ("association.gate_probability.x", "no parameter is called 'association.gate_probability.x'"),
        ("association.enabled[0]", r"association.enabled has no such element"),
        ("association.__class__", "no parameter is called"),
        ("observation.range_sigma]", "no parameter is called"),
    ],
)
def test_a_name_that_there_is_not_is_answered_with_those_there_are(name, message):
    for ask in (
        lambda: get_field(Parameters(), name, "parameter"),
        lambda: with_field(Parameters(), name, 1, "parameter"),
    ):
        with pytest.raises(UsageError, match=message):
            ask()


def test_a_whole_group_is_no_parameter():
    with pytest.raises(
        UsageError, match=r"no parameter is called 'association'; expected one of: association\.enabled"
    ):
        with_field(Parameters(), "association", 0.9, "parameter")
    group = AssociationParameters(gate_probability=0.9)
    assert get_field(with_field(Parameters(), "association", group), "association") == group


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        (
            "observation.range_sigma",
            "wide",
            "observation.range_sigma is 'wide'; expected a number .*measured range .m.",
        ),
        ("observation.range_sigma", True, "observation.range_sigma is True; expected a number"),
        ("observation.range_sigma", None, "observation.range_sigma is None; expected a number"),
        ("observation.range_sigma", 0.0, "observation.range_sigma is 0; expected more than 0 m"),
        ("observation.range_sigma", math.inf, r"observation.range_sigma is inf; expected at most 1e\+09 m"),
        ("detector.min_model_error", 1.5, "detector.min_model_error is 1.5; expected a whole number"),
        ("detector.min_model_error", math.nan, "detector.min_model_error is nan; expected a whole number"),
        ("detector.min_model_error", -1, "detector.min_model_error is -1; expected 0 beams or more"),
        ("detector.enabled", 1, "detector.enabled is 1; expected true or false"),
        ("detector.center", "middle", "detector.center is 'middle'; expected 'circle' or 'central_beam'"),
        ("detector.center", 3, "detector.center is 3; expected text"),
    ],
)
def test_a_wrong_content_is_refused_with_what_is_expected(name, value, message):
    with pytest.raises(ValueError, match=message):
        with_field(Parameters(), name, value)


def test_numbers_take_the_type_of_their_field():
    assert isinstance(with_field(Parameters(), "observation.range_sigma", 1).observation.range_sigma, float)
    assert isinstance(with_field(Parameters(), "detector.min_model_error", 3.0).detector.min_model_error, int)


def test_a_word_becomes_one_of_its_enumeration_and_none_where_it_may_be():
    flat = with_field(Reflector(id="a", x=0.0, y=0.0), "kind", "flat")
    assert flat.kind is ReflectorKind.FLAT
    with pytest.raises(ValueError, match="kind is 'round'; expected one of: cylinder, flat"):
        with_field(flat, "kind", "round")
    assert with_field(Demands(position_limit=0.1), "position_limit", None).position_limit is None


def test_each_number_of_a_list_is_checked_and_named():
    with pytest.raises(ValueError, match=r"vehicle.outline\[1\]\[0\] is nan; expected a finite number"):
        DifferentialVehicle(outline=((0.5, 0.3), (math.nan, 0.3), (-0.5, -0.3)))
    with pytest.raises(ValueError, match=r"control_points\[2\]\[1\] is 1.1e\+07; expected -1e\+07 to 1e\+07 m"):
        Segment(control_points=[[0, 0], [1, 0], [2, 1.1e7], [3, 0]])
    assert Segment(control_points=[[0, 0], [1, 0], [2, 1e7], [3, 0]]).control_points[2, 1] == 1e7


class Size(StrEnum):
    SMALL = "small"
    LARGE = "large"


@dataclasses.dataclass(frozen=True)
class Box:
    width: Annotated[float, Quantity(label="Width", unit="m", bounds=NOT_NEGATIVE, decimals=1)] = 0.0
    """How wide."""
    most: Annotated[float | None, Quantity(label="Most", unit="m", decimals=1)] = None
    """How wide at most; none: no limit."""
    size: Annotated[Size, Choice("Size")] = Size.SMALL
    """Small or large."""
    inner: tuple["Box", ...] = ()

    def __post_init__(self) -> None:
        check_fields(self, "box.")
        if self.most is not None and not self.width < self.most:
            raise ValueError("too wide")


def test_options_of_an_enumeration_need_not_be_said_again():
    assert fields_of(Box)["size"].options == ("small", "large")
    assert fields_of(Box)["most"].is_optional
    assert fields_of(Box)["most"].kind is float


def test_a_value_is_rounded_for_a_file_with_what_is_inside_it():
    box = Box(width=0.123, inner=(Box(width=0.36, most=5.0),))
    assert in_file(box) == Box(width=0.1, inner=(Box(width=0.4, most=5.0),))
    assert in_file(in_file(box)) == in_file(box)
    assert in_file(Box(width=0.5)) == Box(width=0.5)


def test_a_value_that_refuses_its_rounded_numbers_keeps_them_all():
    narrow = Box(width=0.12, most=0.13)
    assert in_file(narrow) == narrow
    scanner = Scanner(range=(0.00001, 0.00002))
    assert in_file(scanner).range == scanner.range


def test_arrays_are_rounded_as_well():
    segment = Segment(control_points=np.array([[0.1 + 0.2, 0], [1, 5.640000000000006], [2, 0], [3, 0]]))
    assert in_file(segment).control_points.tolist() == [[0.3, 0], [1, 5.64], [2, 0], [3, 0]]
