"""What a run says of the map, in words: reflectors that do not stand to each other as it says."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from commission.localization import whole_run
from commission.localization.estimate import Mode
from commission.localization.run_columns import RunColumns
from commission.localization.setup import LocalizerSetup
from commission.site.quantity import MILLIMETRES
from commission.site.reflectors import ReflectorMap
from commission.studies.map_shape import MapShape, map_shape
from commission.studies.plausibility import Finding
from commission.studies.run import RunResult

LOST_SHARE = 0.2
"""Share of the cycles in which the vehicle is lost from which on the drive is localized once more [0..1]."""
FREE_M = 0.1
"""1-sigma of all places then [m]: the gate lets pass what stands a hand off."""
MOST_NAMED = 6
"""Reflectors that are named one by one."""


def shape_of_map(result: RunResult) -> MapShape | None:
    """Hold what a drive has seen against the map.

    Parameters
    ----------
    result : the run.

    Returns
    -------
    shape : None where there were several setups on the way.

    Notes
    -----
    Where the vehicle is lost for long, its detections are held against the map once more in a run whose gate is wide
    and which is never lost: a wrong map is a reason to be lost.
    """
    first, *others = result.inputs.segments
    if others:
        return None
    columns, setup = result.columns, first.setup
    shape = map_shape(columns, setup)
    if not shape.wrong and float(np.mean(columns.modes == Mode.LOST)) > LOST_SHARE:
        shape = map_shape(_localized_freely(result, columns, setup), setup)
    return shape


def _localized_freely(result: RunResult, columns: RunColumns, setup: LocalizerSetup) -> RunColumns:
    """Localize a drive with places that are hardly known, and without a supervisor."""
    reflectors = (replace(each, sigma=max(each.sigma, FREE_M)) for each in setup.reflectors.reflectors)
    unwatched = replace(setup.parameters.supervisor, enabled=False)
    freed = replace(
        setup,
        reflectors=ReflectorMap(tuple(reflectors)),
        parameters=replace(setup.parameters, supervisor=unwatched),
    )
    return whole_run.run(result.inputs.log, freed, result.inputs.start.state(), detected=columns.detected)


def told_of(shape: MapShape, setup: LocalizerSetup) -> tuple[Finding, ...]:
    """Say which reflectors are wrong, how far, and what to do; nothing where none is.

    Parameters
    ----------
    shape : what scans say of the map.
    setup : its reflectors.
    """
    if not shape.wrong:
        return ()
    names = [each.id for each in setup.reflectors.reflectors]
    far = np.hypot(shape.off[:, 0], shape.off[:, 1])
    worst = sorted(shape.wrong, key=lambda index: -far[index])
    each = [
        f"{names[index]} by {MILLIMETRES.text(float(far[index]))} "
        f"({MILLIMETRES.text(float(shape.off[index, 0]), '+.0f')} in x, "
        f"{MILLIMETRES.text(float(shape.off[index, 1]), '+.0f')} in y)"
        for index in worst[:MOST_NAMED]
    ]
    more = f", and {len(worst) - MOST_NAMED} more" if len(worst) > MOST_NAMED else ""
    most = 2 * len(worst) >= len(shape.judged)
    axis = math.sqrt(0.5 * float(np.mean(far[list(shape.judged)] ** 2)))
    return (
        Finding(
            found=f"{len(worst)} of {len(shape.judged)} reflectors do not stand to each other as the map says, by "
            f"{shape.scans} scans that see several of them: {', '.join(each)}{more}",
            probably="the map is wrong as a whole, and so is the pose, whatever its covariance says"
            if most
            else "they were moved or surveyed wrongly, and draw the pose with them, whatever its covariance says",
            remedy=f"survey the reflectors again; until then set uncertainty.survey to {max(axis, 0.001):.3f} m"
            if most
            else "survey them again, or take them out of the map; `monitor` says where they stand",
        ),
    )
