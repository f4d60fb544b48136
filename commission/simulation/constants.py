"""Constants of a virtual world, drawn once for each seed, and the site as it truly is with them.

Each kind of constant has its own random numbers, those of a scanner or reflector depend on its name: switching one on,
or taking a reflector off the map, leaves all others and the noise of the drive as they were.
"""

from __future__ import annotations

import zlib
from dataclasses import replace

import numpy as np

from commission.geometry.arrays import FloatArray
from commission.simulation.drive import driven_wheels
from commission.site.disturbances import ConstantErrors, ScannerError
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.tags import Tag
from commission.site.truth import TAG_CAMERA, TruePlace, TrueTag, TrueWheels, Truth

STREAM = 5
"""Stream of random numbers of a seed, beside those of `scenario`; the next number says which kind of constant."""
SURVEY, MOUNTING, RANGE_BIAS, CLOCK, WHEEL_SCALE, TAG = range(1, 7)


def draw_truth(project: Project, route: str, seed: int) -> Truth:
    """Draw what is true in one virtual drive.

    Parameters
    ----------
    project : reflectors, vehicle, and `disturbances` that say what is drawn.
    route : which route is driven.
    seed : the same seed gives the same constants.
    """
    errors = project.disturbances.constants
    places = (_place(reflector, errors, seed) for reflector in project.reflectors.reflectors)
    draws = _normal(seed, WHEEL_SCALE, "", 2 + driven_wheels(project.vehicle))
    each = errors.wheel_scale_sigma * draws[2:] if errors.wheel_scale_sigma else ()
    return Truth(
        seed=seed,
        route=route,
        wheels=TrueWheels(
            noise=project.disturbances.wheels,
            forward_scale=float(errors.forward_scale_sigma * draws[0]),
            wheel_scales=tuple(map(float, each)),
            separation_scale=float(errors.separation_scale_sigma * draws[1]),
        ),
        scanners=tuple(_scanner(scanner.name, errors, seed) for scanner in project.scanners),
        reflectors=tuple(place for place in places if place is not None),
        tags=tuple(off for off in (_tag(tag, errors, seed) for tag in project.tags) if off is not None),
        tag_camera=_scanner(TAG_CAMERA, errors, seed) if project.tags else ScannerError(scanner=TAG_CAMERA),
    )


def true_site(project: Project, truth: Truth) -> Project:
    """Return the site as it is: reflectors where they stand, scanners as they are mounted."""
    moved = {place.id: place for place in truth.reflectors}
    reflectors = project.reflectors
    if moved:
        reflectors = ReflectorMap(
            tuple(
                replace(each, x=each.x + moved[each.id].dx, y=each.y + moved[each.id].dy) if each.id in moved else each
                for each in reflectors.reflectors
            )
        )
    scanners = tuple(
        replace(each, mounting=each.mounting + np.array(error_of(truth, each.name).mounting))
        for each in project.scanners
    )
    tags = {tag.id: tag for tag in truth.tags}
    return replace(
        project,
        reflectors=reflectors,
        scanners=scanners,
        tags=tuple(_moved(each, tags[each.id]) if each.id in tags else each for each in project.tags),
        tag_camera=replace(
            project.tag_camera, mounting=project.tag_camera.mounting + np.array(truth.tag_camera.mounting)
        ),
    )


def _moved(tag: Tag, off: TrueTag) -> Tag:
    """Return a tag where it stands."""
    return replace(tag, x=tag.x + off.dx, y=tag.y + off.dy, heading=tag.heading + off.turn)


def _tag(tag: Tag, errors: ConstantErrors, seed: int) -> TrueTag | None:
    """Where a tag stands; None where that is where the map says."""
    sigma = errors.survey_factor * tag.sigma if tag.sigma > 0.0 else errors.survey_sigma
    turn = errors.survey_factor * tag.heading_sigma
    if not sigma and not turn:
        return None
    draws = _normal(seed, TAG, tag.id, 3)
    dx, dy = (float(off) for off in sigma * draws[:2])
    return TrueTag(id=tag.id, dx=dx, dy=dy, turn=float(turn * draws[2]))


def error_of(truth: Truth, scanner: str) -> ScannerError:
    """Errors of the scanner of that name; none where nothing is said of it."""
    return next((each for each in truth.scanners if each.scanner == scanner), ScannerError(scanner=scanner))


def _place(reflector: Reflector, errors: ConstantErrors, seed: int) -> TruePlace | None:
    """Where a reflector stands; None where that is where the map says."""
    sigma = errors.survey_factor * reflector.sigma if reflector.sigma > 0.0 else errors.survey_sigma
    if not sigma:
        return None
    dx, dy = (float(off) for off in sigma * _normal(seed, SURVEY, reflector.id, 2))
    return TruePlace(id=reflector.id, dx=dx, dy=dy)


def _scanner(name: str, errors: ConstantErrors, seed: int) -> ScannerError:
    """Errors of one scanner: what the project says of it, and what is drawn."""
    said = [each for each in errors.scanners if each.scanner == name]
    off = np.array(errors.mounting_sigma) * _normal(seed, MOUNTING, name, 3)
    x, y, heading = (float(each) for each in off + sum((np.array(each.mounting) for each in said), np.zeros(3)))
    bias = errors.range_bias_sigma * float(_normal(seed, RANGE_BIAS, name, 1)[0])
    clock = errors.clock_offset_sigma * float(_normal(seed, CLOCK, name, 1)[0])
    return ScannerError(
        scanner=name,
        mounting=(x, y, heading),
        range_bias=bias + sum(each.range_bias for each in said),
        clock_offset=clock + sum(each.clock_offset for each in said),
    )


def _normal(seed: int, kind: int, name: str, count: int) -> FloatArray:
    """(count,) standard normal numbers of one kind of constant, of the thing of a name."""
    return np.random.default_rng((seed, STREAM, kind, zlib.crc32(name.encode()))).standard_normal(count)
