"""Ambiguity while the pose is tracked: neighbors that detections may be taken for along a route, and how often.

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

REACHED = 3.1
"""Sigma by which a detection lies toward a neighbor at most: beyond, fewer than one of a thousand does."""
NODES = 24
"""Nodes of the integral over the neighbor's gate: to 1e-9 of it."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class NeighborRisk:
    """Two reflectors that may be taken for each other on a route."""

    reflector: int
    """The one that is detected: index into the reflector map."""
    neighbor: int
    """The one it may be taken for."""
    scans: IntArray
    """Scans of the drive at which a detection of the reflector may be taken for the neighbor."""
    metres: FloatArray
    """Way driven at those scans [m]."""
    probability: FloatArray
    """Probability at each of them that a detection of the reflector is taken for the neighbor [0..0.5]."""

    @property
    def worst(self) -> float:
        """Largest probability."""
        return float(self.probability.max())


def neighbor_risks(planned: PlannedRoute, prediction: RoutePrediction) -> tuple[NeighborRisk, ...]:
    """Find the reflectors whose neighbors are closer than the gate along a route.

    With S the innovation covariance and d^2 the squared Mahalanobis distance between the two expected observations, a
    detection is nearer to the wrong one (by which the association decides up to det S), and inside its gate, with the
    probability of `mistaken`. Where both reflectors are detected in one scan, the localizer lets only the nearer of two
    claims stand: then a wrong association also needs the other detection to go astray or missing.

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
    # Half of the way is the wrong one's side; and it must be inside that one's gate.
    most = min(2.0 * REACHED, REACHED + math.sqrt(model.gate_d2)) ** 2
    pairs = cKDTree(centers).query_pairs(_reach(planned, prediction, most), output_type="ndarray").reshape(-1, 2)
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
        inside = squared <= most
        if inside.any():
            probability = mistaken(squared[inside], model.gate_d2)
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


def mistaken(squared: FloatArray, gate: float) -> FloatArray:
    """Probability that a detection is taken for a neighbor: (n,) array [0..0.5].

    Parameters
    ----------
    squared : (n,) squared Mahalanobis distance d^2 of the neighbor from the reflector, by its innovation.
    gate : squared Mahalanobis distance within which a detection is taken; inf: any.

    Notes
    -----
    The integral of the normal distribution of two dimensions over the disk of radius g = sqrt(gate) about (d, 0), where
    x > d / 2: of phi(x) (2 Phi(sqrt(g^2 - (x - d)^2)) - 1), with x = d + g sin(a); Phi(-d / 2) without a gate. Derived.
    """
    d = np.sqrt(squared)
    if not math.isfinite(gate):
        return np.asarray(ndtr(-0.5 * d), dtype=np.float64)
    g = math.sqrt(gate)
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    first = np.arcsin(np.maximum(-0.5 * d / g, -1.0))
    half = 0.5 * (0.5 * math.pi - first)
    a = first[:, np.newaxis] + half[:, np.newaxis] * (nodes + 1.0)
    across = g * np.cos(a)
    x = d[:, np.newaxis] + g * np.sin(a)
    density = np.exp(-0.5 * x * x) / math.sqrt(2.0 * math.pi) * (2.0 * ndtr(across) - 1.0) * across
    return np.asarray(half * (density @ weights), dtype=np.float64)


def _reach(planned: PlannedRoute, prediction: RoutePrediction, most: float) -> float:
    """Distance on the floor beyond which no neighbor is ever within a squared Mahalanobis distance [m]."""
    farthest = float(planned.farthest.max(initial=0.0)) + max(
        float(np.hypot(*scanner.mounting[:2])) for scanner in planned.scanners
    )
    # Range and bearing each within sqrt(most) of their own sigma; the bearing seen from the farthest reflector.
    s_rr, w, schur = prediction.innovations.T
    along = float(s_rr.max(initial=0.0))
    across = farthest**2 * float((schur + w * w * s_rr).max(initial=0.0))
    return math.sqrt(most * (along + across))


def _rows_by_reflector(planned: PlannedRoute) -> list[IntArray]:
    """Where each reflector stands among those visible at all scans, one scan after the other."""
    order = np.argsort(planned.visible.indices, kind="stable")
    starts = np.searchsorted(planned.visible.indices[order], np.arange(len(planned.places) + 1))
    return [order[starts[m] : starts[m + 1]] for m in range(len(planned.places))]
