"""A driven or replayed run laid beside a prediction: which metre of the route each cycle belongs to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from commission.app.base.view import LivedPath
from commission.geometry.arrays import FloatArray
from commission.planning.route_prediction import RoutePrediction

MOST_CYCLES = 300
AHEAD = 0.5
"""How much farther than the vehicle moved the next metre is searched [m]: a route that goes back on itself passes each
place twice, and only the way driven tells which time it is."""
BESIDE = 1.0
"""Distance from the route at which a run is another one's [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class DrivenMetres:
    """A run over the metres of a route."""

    metres: FloatArray
    """(N,) metre of the way, never falling [m]."""
    two_sigma: FloatArray
    """(N, 2) 2-sigma of the position [m], as the supervisor takes it, and of the heading [rad], the largest since the
    row before."""


def driven(lived: LivedPath, prediction: RoutePrediction) -> DrivenMetres | None:
    """Find the metre of the route for each cycle of a run.

    Parameters
    ----------
    lived : the run so far.
    prediction : of the route.

    Returns
    -------
    driven : as far as the run follows the route from its start; none when it does not.
    """
    cycles = len(lived.poses)
    if not cycles:
        return None
    supervised = np.column_stack((lived.position_two_sigma, lived.two_sigma[:, 2]))
    starts = np.arange(0, cycles, max(1, -(-cycles // MOST_CYCLES)))
    places, two_sigma = lived.poses[starts, :2], np.maximum.reduceat(supervised, starts, axis=0)
    drive = prediction.drive
    metres, reached = np.empty(len(starts)), 0
    for number, place in enumerate(places):
        # A run that is fast-forwarded has cycles far apart: the window grows with the way between them.
        step = float(np.hypot(*(place - places[number - 1]))) if number else 0.0
        last = int(np.searchsorted(drive.metres, drive.metres[reached] + AHEAD + step, side="right"))
        distances = np.hypot(*(drive.poses[reached:last, :2] - place).T)
        nearest = int(np.argmin(distances))
        if distances[nearest] > BESIDE:
            metres, two_sigma = metres[:number], two_sigma[:number]
            break
        reached += nearest
        metres[number] = drive.metres[reached]
    return DrivenMetres(metres, two_sigma) if len(metres) > 1 else None
