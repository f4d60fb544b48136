"""Which reflectors a vehicle sees: those that any of its scanners sees.

How one scanner sees is in `visibility`; what their measurements together are good for, in `vehicle_fixes`.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from commission.geometry.arrays import BoolArray, FloatArray
from commission.geometry.raycast import RayCaster
from commission.planning.visibility import VisibilityModel, VisibilityOptions, VisibleReflectors, visibility_models
from commission.site.parts import Sighted
from commission.site.reflectors import ReflectorMap
from commission.site.scanner import Scanner


@dataclass(frozen=True, slots=True, eq=False)
class VehicleVisibility:
    """Reflectors and walls, prepared for all scanners of a vehicle."""

    models: tuple[VisibilityModel, ...]
    """Of each scanner, one at least; they have the same M reflectors, walls and options."""

    def __post_init__(self) -> None:
        if not self.models:
            raise ValueError("visibility of a vehicle without scanners; expected one at least")
        if any(a.reflectors != b.reflectors or a.caster is not b.caster for a, b in pairwise(self.models)):
            raise ValueError("scanners among different reflectors or walls; expected the same ones")

    @property
    def reflectors(self) -> ReflectorMap:
        """The M reflectors."""
        return self.models[0].reflectors

    @property
    def caster(self) -> RayCaster:
        """The walls."""
        return self.models[0].caster

    @property
    def options(self) -> VisibilityOptions:
        """What counts as visible."""
        return self.models[0].options

    @property
    def scanners(self) -> tuple[Scanner, ...]:
        """The scanners."""
        return tuple(model.scanner for model in self.models)

    @property
    def widest(self) -> float:
        """Distance beyond which no two reflectors are seen from one pose [m]."""
        # Two scanners may each see one of the two; of one scanner their mountings cancel.
        farthest = [float(model.targets.farthest.max(initial=0.0)) for model in self.models]
        mountings = np.array([scanner.mounting[:2] for scanner in self.scanners])
        gaps: FloatArray = np.hypot(*(mountings[:, np.newaxis] - mountings).transpose(2, 0, 1))
        return float(np.max(gaps + np.add.outer(farthest, farthest)))

    def visible_from_poses(self, poses: ArrayLike) -> VisibleReflectors:
        """Reflectors inside the field of view of any scanner.

        Parameters
        ----------
        poses : (N, 3) array `T_map_base` [m, m, rad]; the mountings of the scanners are added here.
        """
        first, *others = (model.visible_from_poses(poses) for model in self.models)
        if not others:
            return first
        count = len(self.reflectors)
        sees = first.incidence(count)
        for other in others:
            sees |= other.incidence(count)
        return VisibleReflectors(np.concatenate(([0], np.cumsum(sees.sum(axis=1)))), np.nonzero(sees)[1])

    def restricted(self, kept: BoolArray) -> VehicleVisibility:
        """Return that of some of its reflectors: those of a mask (M,), in their order. No shadow is cast anew."""
        return VehicleVisibility(tuple(model.restricted(kept) for model in self.models))


def vehicle_visibility(site: Sighted, options: VisibilityOptions | None = None) -> VehicleVisibility:
    """Prepare the reflectors and walls of a site for its vehicle; one without a floor map is an open field.

    Parameters
    ----------
    site : a project, or what of it says which reflectors are seen from where.
    options : what counts as visible; the defaults when None.
    """
    return VehicleVisibility(visibility_models(site, options))
