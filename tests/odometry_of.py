"""Odometry of a good vehicle, more precise than one may take for granted: for tests that need it to be."""

from __future__ import annotations

from commission.site.parameters import OdometryParameters

PRECISE = OdometryParameters(
    forward_per_sqrt_m=0.01, lateral_per_sqrt_m=0.003, heading_per_sqrt_m=0.006, heading_per_sqrt_rad=0.01
)
