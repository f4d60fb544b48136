"""Which kernels the studies need, step by step, under the names that the page shows while they compile.

A study warms up what it needs as its first part, so that progress does not stand still for a minute.
"""

from __future__ import annotations

from commission.geometry import spline_kernels
from commission.planning import (
    contour_coverage,
    error_budget,
    fix_shares,
    information,
    route_check,
    route_prediction,
    vehicle_fixes,
    visibility,
)

SIGHT = ("lines of sight", visibility.warm_up)
DILUTION = ("dilution", vehicle_fixes.warm_up)
CONTOURS = ("contours over the floor", contour_coverage.warm_up)
SEVERAL_SCANNERS = ("dilution of several scanners", vehicle_fixes.warm_up_several)
CURVES = ("curves", spline_kernels.warm_up)
PREDICTION = ("prediction", route_prediction.warm_up)
ERRORS = ("error budget", error_budget.warm_up)
INFORMATION = ("information about the pose", information.warm_up)
SHARES = ("shares in a fix", fix_shares.warm_up)
ROOM = ("room along routes", route_check.warm_up)

DRIVES = (SIGHT, CURVES, PREDICTION)
"""What every prediction along a route needs."""
