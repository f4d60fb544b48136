"""Tags as an observation kind: each sighting tells x, y and heading at once (Dixon et al. 2010, equations 17 to 23).

Residual, Jacobian and variance of a sighting, whose it is, and its correction. Where tags stand and how the camera is
mounted does not average out: it is considered, like the constants of `consider`. The order of a cycle is `tag_cycle`'s.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from commission.compiled import compiled, compiled_inline
from commission.geometry.angles import wrap_scalar
from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.geometry.gaussian import chi_square_gate
from commission.localization.consider import ConsiderModel
from commission.localization.pose_gaussian import PoseGaussian
from commission.localization.pose_rows import PoseRows, correct_all_by_rows, nis_of_rows
from commission.site.parameters import TagParameters
from commission.site.tag_log import Ids
from commission.site.tags import Tag, TagCamera

PER_CAMERA = 4
"""Considered constants of the camera: x, y and heading of its mounting, clock."""
PER_TAG = 3
"""Of a tag: where it stands along x and y of the map, and how it is turned."""
NOT_READ, NOT_ON_SITE = -1, -2
"""Entries of sightings without an id, and with one that no tag of the site has."""


class TagUse(IntEnum):
    """What became of a sighting."""

    NONE = 0
    """It was not looked at: the kind is switched off, or nobody knows yet where the vehicle is."""
    ACCEPTED = 1
    REJECTED = 2
    """It lies outside of the gate."""
    UNKNOWN = 3
    """No tag of the site has its id; or it has none, and no tag or more than one fits."""
    LOCATED = 4
    """It told a vehicle that did not know it where it is."""


ACCEPTED, REJECTED, UNKNOWN = int(TagUse.ACCEPTED), int(TagUse.REJECTED), int(TagUse.UNKNOWN)
USE, ENTRY, NIS, OFF_X, OFF_Y, OFF_THETA = range(6)
"""Columns of what is known of a sighting: a `TagUse`, row of the tag or -1, NIS, measured less expected in the camera's
frame [m, m, rad]."""
COLUMNS = 6


class TagModel(NamedTuple):
    """Tags, camera and gate, for kernels."""

    places: FloatArray
    """(T, 3) x [m], y [m] and heading [rad] of each tag, map frame."""
    survey: FloatArray
    """(T, 2) variance of its place, each axis [m^2], and of its heading [rad^2]."""
    mount_x: float
    mount_y: float
    mount_theta: float
    gate: float
    """Largest NIS of an accepted sighting, of three degrees of freedom."""
    position_variance: float
    heading_variance: float
    """Noise of a sighting that does not say it."""
    first: int
    """First column of the camera's constants, those of tags follow, in `cross`."""


def tag_model(tags: Sequence[Tag], camera: TagCamera, given: TagParameters, first: int) -> TagModel | None:
    """Return what kernels need; None where tags are switched off or the site has none.

    Parameters
    ----------
    tags : of the site.
    camera : that sees them.
    given : the parameters.
    first : number of considered constants before those of tags.
    """
    if not tags or not given.enabled:
        return None
    places = np.array([(tag.x, tag.y, tag.heading) for tag in tags], dtype=np.float64)
    survey = np.array([(tag.sigma**2, tag.heading_sigma**2) for tag in tags], dtype=np.float64)
    x, y, theta = camera.mounting.tolist()
    gate = chi_square_gate(given.gate_probability, 3)
    variances = given.position_sigma**2, given.heading_sigma**2
    return TagModel(read_only(places), read_only(survey), x, y, theta, gate, *variances, first)


def entries_of(ids: Ids, tags: Sequence[Tag]) -> IntArray:
    """(n,) index of the tag of each id, or NOT_READ, NOT_ON_SITE. An anonymous tag has no id that could be read.

    Parameters
    ----------
    ids : of sightings.
    tags : of the site.
    """
    known = {tag.id: index for index, tag in enumerate(tags) if not tag.anonymous}
    entries = [known.get(each, NOT_ON_SITE) if each else NOT_READ for each in ids.tolist()]
    return read_only(np.array(entries, dtype=np.int64))


@compiled
def tag_rows(
    belief: PoseGaussian, sighting: FloatArray, tag: FloatArray, model: TagModel, twist: tuple[float, float, float]
) -> PoseRows:
    """Three rows of a sighting of one tag, with the camera's and the tag's constants beside them.

    Parameters
    ----------
    belief : before it.
    sighting : (6,) x [m], y [m], heading [rad] in the camera's frame, and 1-sigma of each or NaN.
    tag : (3,) x, y [m] and heading [rad] of the tag, map frame.
    model : mounting and noise.
    twist : velocity of base [m/s, m/s, rad/s], in base.

    Notes
    -----
    z = R(-phi) (t - p - R(theta) m), t_theta - phi with phi = theta + m_theta, and H of it: Dixon et al. 2010,
    equations 17 to 20, which have the camera at base. Of the constants: -R(-m_theta) of the mounting's place, (z_y,
    -z_x, -1) of its heading, -H xdot of a late clock, R(-phi) and 1 of the tag: derived from the same z.
    """
    phi = belief.theta + model.mount_theta
    c, s = math.cos(phi), math.sin(phi)
    facing_c, facing_s = math.cos(belief.theta), math.sin(belief.theta)
    ox = facing_c * model.mount_x - facing_s * model.mount_y
    oy = facing_s * model.mount_x + facing_c * model.mount_y
    dx, dy = tag[0] - belief.x - ox, tag[1] - belief.y - oy
    zx, zy = c * dx + s * dy, c * dy - s * dx
    residuals, variances = np.empty(3), np.empty(3)
    residuals[0], residuals[1] = sighting[0] - zx, sighting[1] - zy
    residuals[2] = wrap_scalar(sighting[2] - (tag[2] - phi))
    for k in range(3):
        own = sighting[3 + k]
        given = model.heading_variance if k == 2 else model.position_variance
        variances[k] = given if math.isnan(own) else own * own
    H, J = np.zeros((3, 3)), np.zeros((3, PER_CAMERA + PER_TAG))
    H[0, 0], H[0, 1], H[0, 2] = -c, -s, zy + c * oy - s * ox
    H[1, 0], H[1, 1], H[1, 2] = s, -c, -zx - s * oy - c * ox
    H[2, 2] = -1.0
    mount_c, mount_s = math.cos(model.mount_theta), math.sin(model.mount_theta)
    J[0, 0], J[0, 1], J[0, 2] = -mount_c, -mount_s, zy
    J[1, 0], J[1, 1], J[1, 2] = mount_s, -mount_c, -zx
    J[2, 2] = -1.0
    speed_x = facing_c * twist[0] - facing_s * twist[1]
    speed_y = facing_s * twist[0] + facing_c * twist[1]
    for k in range(3):
        J[k, 3] = -(H[k, 0] * speed_x + H[k, 1] * speed_y + H[k, 2] * twist[2])
    J[0, PER_CAMERA], J[0, PER_CAMERA + 1] = c, s
    J[1, PER_CAMERA], J[1, PER_CAMERA + 1] = -s, c
    J[2, PER_CAMERA + 2] = 1.0
    return PoseRows(residuals, H, variances, J)


@compiled_inline
def considered_of(entry: int, model: TagModel, variances: ConsiderModel) -> FloatArray:
    """(7,) variances of the constants of camera and tag.

    Parameters
    ----------
    entry : row of the tag.
    model : of the tags.
    variances : of a sensor's mounting and clock.

    Notes
    -----
    No formula: in the order of the columns of `tag_rows`.
    """
    return np.array(
        (
            variances.mount_position,
            variances.mount_position,
            variances.mount_heading,
            variances.clock,
            model.survey[entry, 0],
            model.survey[entry, 0],
            model.survey[entry, 1],
        )
    )


@compiled_inline
def _columns(cross: FloatArray | None, entry: int, model: TagModel) -> FloatArray:
    """(3, 7) covariance of the pose with the constants of camera and tag; zeros where none is considered."""
    columns = np.zeros((3, PER_CAMERA + PER_TAG))
    if cross is not None:
        tag = model.first + PER_CAMERA + PER_TAG * entry
        for row in range(3):
            for i in range(PER_CAMERA):
                columns[row, i] = cross[row, model.first + i]
            for i in range(PER_TAG):
                columns[row, PER_CAMERA + i] = cross[row, tag + i]
    return columns


@compiled_inline
def whose_tag(  # noqa: PLR0917 - a sighting and the site
    belief: PoseGaussian,
    sighting: FloatArray,
    model: TagModel,
    twist: tuple[float, float, float],
    variances: ConsiderModel,
    cross: FloatArray | None,
) -> int:
    """Row of the tag that a sighting without an id is of; NOT_READ where none, or more than one, is inside the gate.

    Parameters
    ----------
    belief, sighting, model, twist, variances : as in `correct_by_tag`.
    cross : covariance with the constants, or None.

    Notes
    -----
    No formula: the only one whose NIS is inside the gate.
    """
    found, inside = NOT_READ, 0
    for entry in range(len(model.places)):
        rows = tag_rows(belief, sighting, model.places[entry], model, twist)
        columns = _columns(cross, entry, model)
        if nis_of_rows(belief, columns, considered_of(entry, model, variances), rows) <= model.gate:
            found, inside = entry, inside + 1
    return found if inside == 1 else NOT_READ


@compiled
def correct_by_tag(  # noqa: PLR0917 - the filter's state around one sighting
    belief: PoseGaussian,
    sighting: FloatArray,
    entry: int,
    model: TagModel,
    twist: tuple[float, float, float],
    variances: ConsiderModel,
    cross: FloatArray | None,
    busy: IntArray | None,
    figures: FloatArray,
    invariant: bool,
) -> PoseGaussian:
    """Correct a belief by a sighting, where it lies inside the gate.

    Parameters
    ----------
    belief : before it.
    sighting : as in `tag_rows`.
    entry : row of the tag, or NOT_READ, NOT_ON_SITE.
    model : of the tags.
    twist : velocity of base [m/s, m/s, rad/s], in base.
    variances : of the camera's constants.
    cross : (3, M) covariance of the pose with the constants at `belief`, written in place, or None: the constants then
        count as noise, as they do for reflectors.
    busy : see `busy_chunks`.
    figures : (COLUMNS,) out: what became of it.
    invariant : whether the covariance is that of a right-invariant error.

    Notes
    -----
    K = P H^T (H P H^T + R)^-1, P' = (I - K H) P, x' = x + K (z - h(x)): Dixon et al. 2010, equations 21 to 23, row by
    row in Joseph's form, with constants considered as in `correct_all_by_rows`.
    """
    figures[:] = 0.0
    if entry == NOT_READ:
        entry = whose_tag(belief, sighting, model, twist, variances, cross)
    figures[ENTRY], figures[NIS] = max(entry, -1), math.nan
    if entry < 0:
        figures[USE] = UNKNOWN
        return belief
    rows = tag_rows(belief, sighting, model.places[entry], model, twist)
    columns, considered = _columns(cross, entry, model), considered_of(entry, model, variances)
    nis = nis_of_rows(belief, columns, considered, rows)
    figures[NIS], figures[OFF_X] = nis, rows.residuals[0]
    figures[OFF_Y], figures[OFF_THETA] = rows.residuals[1], rows.residuals[2]
    if not nis <= model.gate:
        figures[USE] = REJECTED
        return belief
    figures[USE] = ACCEPTED
    stretches = (model.first, PER_CAMERA), (model.first + PER_CAMERA + PER_TAG * entry, PER_TAG)
    return correct_all_by_rows(belief, columns, considered, rows, stretches, cross, busy, invariant)
