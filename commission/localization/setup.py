"""All that the localizer is given and does not change by itself, and the same as scalars and arrays for its kernels."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.geometry.gaussian import ellipse_points
from commission.localization.association import Gate, gate_of
from commission.localization.detector import DetectorModel, detector_model
from commission.localization.estimate import Belief
from commission.localization.observation import ObservationModel, observation_model, validation_ellipses
from commission.localization.odometry import OdometryNoise, odometry_noise
from commission.localization.reflector_index import Cells, ReflectorIndex, build_index
from commission.localization.rejection import RejectionRule, rejection_rule
from commission.localization.supervisor import SupervisorLimits, supervisor_limits
from commission.site.parameters import Parameters
from commission.site.project import Project
from commission.site.reflectors import ReflectorMap
from commission.site.scanner import Scanner


class FilterModel(NamedTuple):
    """What the steps of the filter read, besides the arrays of the map."""

    odometry: OdometryNoise
    observation: ObservationModel
    cells: Cells
    gate: Gate
    limits: SupervisorLimits
    rejection: RejectionRule


@dataclass(frozen=True, slots=True)
class LocalizerSetup:
    """Reflector map, scanners and parameters of a localizer; kernels read `filter` and `detector`.

    Where they are equal, every record is processed alike.
    """

    reflectors: ReflectorMap
    """The reflector map M_B."""
    scanners: tuple[Scanner, ...]
    """Mounting and resolution of the scanners."""
    parameters: Parameters
    """Tunables of every stage."""
    filter: FilterModel = field(init=False, repr=False, compare=False)
    """Scalars of the filter."""
    index: ReflectorIndex = field(init=False, repr=False, compare=False)
    """The reflector map for the filter."""
    detector: DetectorModel = field(init=False, repr=False, compare=False)
    """Scalars and tables of the detector."""

    def __post_init__(self) -> None:
        index = build_index(self.reflectors)
        model = FilterModel(
            odometry_noise(self.parameters.odometry),
            observation_model(self.scanners[0], self.parameters.observation),
            index.cells,
            gate_of(self.parameters.association),
            supervisor_limits(self.parameters.supervisor),
            rejection_rule(self.parameters.supervisor),
        )
        object.__setattr__(self, "index", index)
        object.__setattr__(self, "filter", model)
        detector = detector_model(self.reflectors, self.scanners[0], self.parameters.detector)
        object.__setattr__(self, "detector", detector)

    def detects_like(self, other: LocalizerSetup) -> bool:
        """Whether the same is detected in every scan: what the filter does with it afterwards may differ."""
        if self.parameters.detector.intensity_threshold != other.parameters.detector.intensity_threshold:
            return False
        return all(np.array_equal(a, b) for a, b in zip(self.detector, other.detector, strict=True))

    @staticmethod
    def of(project: Project) -> LocalizerSetup:
        """Return the setup of a project."""
        return LocalizerSetup(project.reflectors, project.scanners, project.parameters)

    def validation_ellipses(self, belief: Belief) -> FloatArray:
        """(N, 2, 2) 1-sigma region [m^2] on the floor in which each reflector is expected to be detected."""
        sigmas = [reflector.sigma for reflector in self.reflectors.reflectors]
        return validation_ellipses(belief, self.filter.observation, self.reflectors.centers, sigmas)

    def validation_outlines(self, belief: Belief, n: int = 48) -> FloatArray:
        """(N, n, 2) outline [m] of the validation gate around each reflector, map frame (the paper's Fig. 12)."""
        scale = self.filter.gate.d2**0.5
        return ellipse_points(self.reflectors.centers, self.validation_ellipses(belief), scale, n)
