"""Covariance of the pose with the considered constants as a value, which knows what each of its columns is about.

So it outlives a change of the map: what is no longer the same constant is independent of the pose. Steps: `consider`.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.site.parameters import ContourParameters
from commission.site.reflectors import Reflector
from commission.site.scanner import Scanner
from commission.site.tags import Tag, TagCamera
from commission.site.uncertainty import Uncertainty

Constants = tuple[Hashable, ...]
"""What each column is about: equal ones are the same unknown number."""


@dataclass(frozen=True, slots=True, eq=False)
class CrossCovariance:
    """Covariance of x, y and heading with each constant."""

    constants: Constants
    """What each column is about."""
    columns: FloatArray
    """(3, len(constants)) [m], [m], [rad] times the unit of the constant; read-only."""

    def __eq__(self, other: object) -> bool:
        """Whether both say the same of the same constants, to the last bit."""
        if not isinstance(other, CrossCovariance):
            return NotImplemented
        return self.constants == other.constants and self.columns.tobytes() == other.columns.tobytes()

    def __hash__(self) -> int:
        """Equal ones have the same."""
        return hash((self.constants, self.columns.tobytes()))


def survey_variance(reflector: Reflector, uncertainty: Uncertainty) -> float:
    """Variance of a reflector's place, each axis [m^2]: its own, or where it has none that of the project.

    What an unknown radius does to its detections comes on top.
    """
    return (reflector.sigma if reflector.sigma > 0.0 else uncertainty.survey) ** 2 + reflector.radius_sigma**2


def constants_of(
    reflectors: Sequence[Reflector], order: IntArray, scanners: Sequence[Scanner], uncertainty: Uncertainty
) -> Constants:
    """What is considered with a map and scanners, in the order of the columns that `consider` works on.

    Parameters
    ----------
    reflectors : of the map.
    order : (N,) index of each row of `ReflectorIndex.places`.
    scanners : of the vehicle.
    uncertainty : 1-sigma of what is considered.
    """
    constants: list[Hashable] = []
    for index in order:
        each = reflectors[index]
        place = (each.id, each.x, each.y, survey_variance(each, uncertainty))
        constants += [("x", *place), ("y", *place)]
    for scanner in scanners:
        mounting = (scanner.name, *map(float, scanner.mounting), uncertainty.mounting_position)
        heading = (scanner.name, *map(float, scanner.mounting), uncertainty.mounting_heading)
        constants += [("mounting x", *mounting), ("mounting y", *mounting), ("mounting heading", *heading)]
        constants += [("range", scanner.name, uncertainty.range_bias), ("clock", scanner.name, uncertainty.clock)]
    return tuple(constants)


def contour_constants(parameters: ContourParameters) -> Constants:
    """What is considered of contours, behind all other constants: how far the map is off where the vehicle is."""
    known = (parameters.map_sigma, parameters.map_heading_sigma, parameters.map_correlation)
    return (("map x", *known), ("map y", *known), ("map heading", *known))


def tag_constants(tags: Sequence[Tag], camera: TagCamera, uncertainty: Uncertainty) -> Constants:
    """What is considered of the camera that looks for tags, then of each tag; none where the site has no tags.

    Parameters
    ----------
    tags : of the site.
    camera : that sees them.
    uncertainty : 1-sigma of mounting and clock.
    """
    if not tags:
        return ()
    at = tuple(map(float, camera.mounting))
    place, heading = (
        ("tag camera", *at, uncertainty.mounting_position),
        ("tag camera", *at, uncertainty.mounting_heading),
    )
    constants: list[Hashable] = [("mounting x", *place), ("mounting y", *place), ("mounting heading", *heading)]
    constants.append(("clock", "tag camera", uncertainty.clock))
    for tag in tags:
        known = (tag.id, tag.x, tag.y, tag.heading, tag.sigma, tag.heading_sigma)
        constants += [("tag x", *known), ("tag y", *known), ("tag heading", *known)]
    return tuple(constants)


def columns_of(cross: CrossCovariance | None, constants: Constants | None) -> FloatArray | None:
    """Columns for the steps to write in: a copy, in the order of these constants; None where none is considered.

    A constant that is new, or was known to another sigma, is independent of the pose.
    """
    if constants is None:
        return None
    if cross is not None and (cross.constants is constants or cross.constants == constants):
        return cross.columns.copy()
    columns = np.zeros((3, len(constants)))
    if cross is not None:
        known = {constant: column for column, constant in enumerate(cross.constants)}
        pairs = [(new, known[constant]) for new, constant in enumerate(constants) if constant in known]
        if pairs:
            new, old = map(list, zip(*pairs, strict=True))
            columns[:, new] = cross.columns[:, old]
    return columns


def cross_covariance(columns: FloatArray | None, constants: Constants | None) -> CrossCovariance | None:
    """Return what steps have left in their columns, as a value; None where all of it is zero."""
    if columns is None or constants is None or not columns.any():
        return None
    return CrossCovariance(constants, read_only(columns))
