"""All that the localizer is given and does not change by itself, and the same as scalars and arrays for its kernels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from commission.errors import UsageError
from commission.geometry.arrays import FloatArray, IntArray
from commission.localization.association import Gate, gate_of
from commission.localization.bearings import BearingModel, bearing_model
from commission.localization.consider import PER_REFLECTOR, PER_SCANNER, ConsiderModel
from commission.localization.contour import ContourModel, contour_model
from commission.localization.cross_covariance import (
    Constants,
    constants_of,
    contour_constants,
    survey_variance,
    tag_constants,
)
from commission.localization.detector_model import DetectorModel, detector_model
from commission.localization.filter_kinds import filter_kind, is_invariant
from commission.localization.joint import SEVERAL_SCANS
from commission.localization.observation import (
    ObservationModel,
    observation_model,
    observation_rows,
)
from commission.localization.odometry import OdometryNoise, odometry_noise
from commission.localization.protection import ProtectionModel
from commission.localization.protection_state import protection_model
from commission.localization.reflector_index import Cells, ReflectorIndex, build_index
from commission.localization.rejection import RejectionRule, rejection_rule
from commission.localization.supervisor import SupervisorLimits, supervisor_limits
from commission.localization.sweep import sweep_of, sweep_rows
from commission.localization.tags import TagModel, tag_model
from commission.localization.temporary_model import TemporaryModel, temporary_model
from commission.localization.zones import ZoneRows, zone_rows
from commission.site.floor_map import FloorMap
from commission.site.parameters import ASSOCIATION_METHODS, Parameters
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.scanner import Scanner
from commission.site.tags import Tag, TagCamera
from commission.site.uncertainty import Uncertainty
from commission.site.zones import Zone

_THRESHOLDS = ("intensity_threshold", "far_threshold", "far_distance")
"""Parameters of the detector that are in no `DetectorModel`: which beams count as reflective is known before it."""
FEWEST_TO_FIND = 3
"""Reflectors of the map from which on a lost vehicle can be searched for: a place needs that many that fit."""


class FilterModel(NamedTuple):
    """What the steps of the filter read, besides the arrays of the map."""

    odometry: OdometryNoise
    cells: Cells
    gate: Gate
    limits: SupervisorLimits
    rejection: RejectionRule
    consider: ConsiderModel


def consider_model(known: Uncertainty) -> ConsiderModel:
    """Return the variances of the constants of a scanner."""
    return ConsiderModel(known.mounting_position**2, known.mounting_heading**2, known.range_bias**2, known.clock**2)


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalizerSetup:
    """Reflector map, scanners, floor map and parameters of a localizer; kernels read `filter` and `detector`.

    Where they are equal, every record is processed alike.
    """

    reflectors: ReflectorMap
    """The reflector map M_B."""
    scanners: tuple[Scanner, ...]
    """Mounting and resolution of the scanners."""
    parameters: Parameters
    """Tunables of every stage."""
    uncertainty: Uncertainty = field(default_factory=Uncertainty)
    """How well map and mounting are known: what the filter considers."""
    floor: FloorMap | None = None
    """Walls of the hall, where the project has them."""
    tags: tuple[Tag, ...] = ()
    """Landmarks that tell place and heading at once."""
    tag_camera: TagCamera = field(default_factory=TagCamera)
    """The camera that sees them."""
    zones: tuple[Zone, ...] = ()
    """Where which kinds of observation correct the pose."""
    filter: FilterModel = field(init=False, repr=False, compare=False)
    """Scalars of the filter."""
    constants: Constants | None = field(init=False, repr=False, compare=False)
    """What the filter considers; None: nothing."""
    index: ReflectorIndex = field(init=False, repr=False, compare=False)
    """The reflector map for the filter."""
    observations: tuple[ObservationModel, ...] = field(init=False, repr=False, compare=False)
    """Mounting and noise of each scanner."""
    observation_rows: FloatArray = field(init=False, repr=False, compare=False)
    """(S, 6) the same, for kernels."""
    sweep_rows: FloatArray = field(init=False, repr=False, compare=False)
    """(S, 4) when and which way up each scanner measures, for kernels; (0, 4) where nothing is to be done."""
    detectors: tuple[DetectorModel, ...] = field(init=False, repr=False, compare=False)
    """Scalars and tables of the detector, for each scanner."""

    tag_model: TagModel | None = field(init=False, repr=False, compare=False)
    """Tags and camera for kernels; None: they are not looked at."""
    bearing_model: BearingModel | None = field(init=False, repr=False, compare=False)
    """The goniometer for kernels; None: there is none, or bearings are not looked at."""
    contour: ContourModel | None = field(init=False, repr=False, compare=False)
    """Contours of the floor map; None: they are not looked at."""
    zone_rows: ZoneRows = field(init=False, repr=False, compare=False)
    """Zones for kernels."""
    protection: ProtectionModel | None = field(init=False, repr=False, compare=False)
    """What protection levels are reckoned with; None: the supervisor does not go by them."""
    temporary: TemporaryModel | None = field(init=False, repr=False, compare=False)
    """Rules of temporary landmarks; None: they are not looked at."""

    def __post_init__(self) -> None:
        considers, known = self.parameters.filter.consider, self.uncertainty
        index = build_index(self.reflectors, self.survey_sigmas)
        limits = supervisor_limits(self.parameters.supervisor)
        # A search by neither could never end; who is lost is so until what is seen fits again.
        can_find = self.finds_by_reflectors or self.contour_floor is not None
        limits = limits._replace(find_again=limits.find_again and can_find)
        kind = filter_kind(self.parameters.filter)
        model = FilterModel(
            odometry_noise(self.parameters.odometry)._replace(curved=float(is_invariant(kind))),
            index.cells,
            gate_of(self.parameters.association, kind),
            limits,
            rejection_rule(self.parameters.supervisor),
            consider_model(known),
        )
        order = index.places[:, 3].astype(np.int64)
        constants = constants_of(self.reflectors.reflectors, order, self.scanners, known) if considers else None
        contour = contour_model(self.floor, self.scanners, self.parameters.contour)
        before = PER_REFLECTOR * len(index.places) + PER_SCANNER * len(self.scanners)
        tags = tag_model(self.tags, self.tag_camera, self.parameters.tag, before)
        if constants is not None and tags is not None:
            constants += tag_constants(self.tags, self.tag_camera, known)
        object.__setattr__(self, "tag_model", tags)
        object.__setattr__(self, "zone_rows", zone_rows(self.zones))
        if constants is not None and contour is not None:
            constants += contour_constants(self.parameters.contour)
        object.__setattr__(self, "contour", contour)
        object.__setattr__(self, "protection", protection_model(self.parameters, index, self.reflectors.reflectors))
        object.__setattr__(self, "temporary", temporary_model(self.scanners, self.parameters.temporary))
        object.__setattr__(self, "constants", constants)
        object.__setattr__(self, "index", index)
        object.__setattr__(self, "filter", model)
        observations = tuple(observation_model(each, self.parameters.observation) for each in self.scanners)
        object.__setattr__(self, "observations", observations)
        object.__setattr__(self, "observation_rows", observation_rows(observations))
        turning = bearing_model(self.scanners, observations, self.parameters, len(index.places))
        object.__setattr__(self, "bearing_model", turning)
        object.__setattr__(self, "sweep_rows", sweep_rows([sweep_of(each) for each in self.scanners]))
        detectors = tuple(detector_model(self.reflectors, each, self.parameters.detector) for each in self.scanners)
        object.__setattr__(self, "detectors", detectors)

    @property
    def finds_by_reflectors(self) -> bool:
        """Whether a lost vehicle can be found by reflectors: not among a few of them, nor by bearings alone."""
        ranging = any(not scanner.is_goniometer for scanner in self.scanners)
        return ranging and len(self.reflectors.reflectors) >= FEWEST_TO_FIND

    @property
    def contour_floor(self) -> FloorMap | None:
        """The floor map whose contours are looked at; None: they are not."""
        return self.parameters.contour.seen_of(self.floor)

    @property
    def decides_over_scans(self) -> bool:
        """Whether several scans are decided on together."""
        association = self.parameters.association
        return association.enabled and association.method == ASSOCIATION_METHODS[SEVERAL_SCANS]

    @property
    def protected_names(self) -> tuple[str, ...] | None:
        """Ids of the reflectors, by their numbers in `protection`; None: the supervisor does not go by its levels."""
        return None if self.protection is None else tuple(each.id for each in self.reflectors.reflectors)

    @property
    def survey_sigmas(self) -> FloatArray:
        """(N,) 1-sigma of each reflector's place, each axis [m]: without considering, of those that have one alone."""
        each = self.reflectors.reflectors
        if not self.parameters.filter.consider:
            return np.array([reflector.own_sigma for reflector in each], dtype=np.float64)
        return np.sqrt([survey_variance(reflector, self.uncertainty) for reflector in each])

    def detects_like(self, other: LocalizerSetup) -> bool:
        """Whether the same is detected in every scan: what the filter does with it afterwards may differ."""
        mine, others = self.parameters.detector, other.parameters.detector
        if any(getattr(mine, name) != getattr(others, name) for name in _THRESHOLDS):
            return False
        if [each.name for each in self.scanners] != [each.name for each in other.scanners]:
            return False
        if [each.blind_sectors_deg for each in self.scanners] != [each.blind_sectors_deg for each in other.scanners]:
            return False
        pairs = zip(self.detectors, other.detectors, strict=True)
        return all(np.array_equal(a, b) for pair in pairs for a, b in zip(*pair, strict=True))

    def indices_of(self, names: Sequence[str]) -> IntArray:
        """Indices of the scanners that a log names.

        Parameters
        ----------
        names : of a log. Where both have one scanner it is the same one, whatever it is called: logs of old know none.

        Returns
        -------
        indices : (len(names),) array into `scanners`.

        Raises
        ------
        UsageError
            a name is none of the setup's; says which there are.
        """
        own = [scanner.name for scanner in self.scanners]
        # Bearings of a goniometer need no name: a vehicle has one at most.
        scanning = [index for index, scanner in enumerate(self.scanners) if not scanner.is_goniometer] or [0]
        if len(scanning) == len(names) == 1 and (len(own) == 1 or names[0] not in own):
            return np.array(scanning, dtype=np.int64)
        for name in names:
            if name not in own:
                known = ", ".join(own)
                raise UsageError(f"the recording's scanner {name!r} is none of the project's; expected {known}")
        return np.array([own.index(name) for name in names], dtype=np.int64)

    @staticmethod
    def of(project: Project) -> LocalizerSetup:
        """Return the setup of a project."""
        return LocalizerSetup(
            reflectors=project.reflectors,
            scanners=project.scanners,
            parameters=project.parameters,
            uncertainty=project.uncertainty,
            floor=project.floor_map,
            tags=project.tags,
            tag_camera=project.tag_camera,
            zones=project.zones,
        )
