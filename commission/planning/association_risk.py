"""Ambiguity while the pose is tracked: neighbors inside each other's gate along a route, and how often they mislead.

Poses without any history are in `ambiguity`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree  # pyright: ignore[reportAttributeAccessIssue]
from scipy.special import ndtr  # pyright: ignore[reportAttributeAccessIssue]

from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.planning.prediction_kernels import separations
from commission.planning.route_prediction import PlannedRoute, RoutePrediction

WITHOUT_GATE = 25.0
"""Squared Mahalanobis distance within which neighbors are listed when there is no gate: one mistake in 160."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class NeighborRisk:
    """Two reflectors that may be taken for each other on a route."""

    reflector: int
    """The one that is detected: index into the reflector map."""
    neighbor: int
    """The one it may be taken for."""
    scans: IntArray
    """Scans of the drive at which the neighbor lies inside the gate of the reflector."""
    metres: FloatArray
    """Way driven at those scans [m]."""
    probability: FloatArray
    """Probability at each of them that a detection of the reflector fits the neighbor better [0..0.5]."""

    @property
    def worst(self) -> float:
        """Largest probability."""
        return float(self.probability.max())


def neighbor_risks(planned: PlannedRoute, prediction: RoutePrediction) -> tuple[NeighborRisk, ...]:
    """Find the reflectors whose neighbors are closer than the gate along a route.

    With S the innovation covariance and d the difference between the two expected observations, a detection is nearer
    to the wrong one (in Mahalanobis distance, by which the association decides up to det S) with the probability
    Phi(-sqrt(d^T S^-1 d) / 2). Where both reflectors are detected in one scan, the localizer lets only the nearer of
    two claims stand: then a wrong association also needs the other detection to go astray or missing.

    Parameters
    ----------
    planned : drive and visible reflectors.
    prediction : of that drive; its covariance of each innovation is what the gate is made of.

    Returns
    -------
    risks : the most probable first; empty with fewer than two reflectors.
    """
    centers = planned.places[:, :2]
    model = planned.model()
    if len(centers) < 2 or not len(planned.visible.indices):
        return ()
    gate = model.gate_d2 if math.isfinite(model.gate_d2) else WITHOUT_GATE
    pairs = cKDTree(centers).query_pairs(_reach(planned, prediction, gate), output_type="ndarray").reshape(-1, 2)
    risks: list[NeighborRisk] = []
    sees = _rows_by_reflector(planned)
    scan_of = np.repeat(np.arange(len(planned.drive), dtype=np.int64), planned.visible.counts())
    for reflector, neighbor in np.concatenate((pairs, pairs[:, ::-1])).tolist():
        rows = sees[reflector]
        scans = scan_of[rows]
        squared = np.empty(len(rows))
        separations(
            rows,
            scans,
            planned.drive.poses,
            planned.drive.scanners,
            prediction.innovations,
            planned.places,
            reflector,
            neighbor,
            model.observations,
            squared,
        )
        inside = squared <= gate
        if inside.any():
            probability = np.asarray(ndtr(-0.5 * np.sqrt(squared[inside])), dtype=np.float64)
            chosen = scans[inside]
            metres = planned.drive.metres[chosen]
            risks.append(
                NeighborRisk(
                    reflector=reflector,
                    neighbor=neighbor,
                    scans=read_only(chosen),
                    metres=metres,
                    probability=read_only(probability),
                )
            )
    return tuple(sorted(risks, key=lambda risk: (-risk.worst, risk.reflector, risk.neighbor)))


def _reach(planned: PlannedRoute, prediction: RoutePrediction, gate: float) -> float:
    """Distance on the floor beyond which no neighbor is ever inside a gate [m]."""
    farthest = float(planned.farthest.max(initial=0.0)) + max(
        float(np.hypot(*scanner.mounting[:2])) for scanner in planned.scanners
    )
    # Range and bearing each within sqrt(gate) of their own sigma; the bearing seen from the farthest reflector.
    s_rr, w, schur = prediction.innovations.T
    along = float(s_rr.max(initial=0.0))
    across = farthest**2 * float((schur + w * w * s_rr).max(initial=0.0))
    return math.sqrt(gate * (along + across))


def _rows_by_reflector(planned: PlannedRoute) -> list[IntArray]:
    """Where each reflector stands among those visible at all scans, one scan after the other."""
    order = np.argsort(planned.visible.indices, kind="stable")
    starts = np.searchsorted(planned.visible.indices[order], np.arange(len(planned.places) + 1))
    return [order[starts[m] : starts[m + 1]] for m in range(len(planned.places))]
