"""Strength of one echo, and what a beam with several of them measures: compiled closed forms, without any geometry."""

from __future__ import annotations

import math
from typing import NamedTuple

from commission.compiled import compiled_inline
from commission.site.intensity import IntensityModel

WALL, PERSON, TAPE, SHINY = range(4)
"""Kinds of surfaces."""


class Light(NamedTuple):
    """Numbers of an `IntensityModel` for kernels, in its units."""

    reference_distance: float
    range_exponent: float
    near_distance: float
    tape: float
    tape_exponent: float
    wall: float
    people: float
    shiny: float
    shiny_lobe: float
    noise: float
    echo_length: float
    crosstalk: float
    crosstalk_width: float
    response: float
    largest: float


def light_of(model: IntensityModel) -> Light:
    """Return the numbers of a model."""
    return Light(
        model.reference_distance,
        model.range_exponent,
        model.near_distance,
        model.reflector,
        model.reflector_exponent,
        model.wall,
        model.people,
        model.shiny,
        model.shiny_lobe,
        model.noise,
        model.echo_length,
        model.crosstalk,
        model.crosstalk_width,
        model.response,
        model.largest,
    )


@compiled_inline
def at_distance(distance: float, light: Light) -> float:
    """Intensity of a surface at a distance, in parts of that at the reference distance.

    Parameters
    ----------
    distance : [m], more than 0.
    light : of the virtual world.

    Notes
    -----
    h(r) / h(r0) with h(r) = (1 - exp(-(r / n)^2)) r^-p: the lidar equation with an overlap of beam and receiver that
    grows with the distance, by definition.
    """
    fall = (light.reference_distance / distance) ** light.range_exponent
    if light.near_distance == 0.0:
        return fall
    here, there = distance / light.near_distance, light.reference_distance / light.near_distance
    return fall * (1.0 - math.exp(-here * here)) / (1.0 - math.exp(-there * there))


@compiled_inline
def of_surface(kind: int, cosine: float, light: Light) -> float:
    """Intensity of a surface at the reference distance.

    Parameters
    ----------
    kind : WALL, PERSON, TAPE or SHINY.
    cosine : of the angle of incidence [0..1].
    light : of the virtual world.

    Notes
    -----
    Lambert's level x cos(i) of walls and people, level x cos(i)^n of tape; of shiny objects that of a wall and
    level x exp(-i^2 / 2 s^2), a mirror with a Gaussian lobe: by definition.
    """
    if kind == TAPE:
        return light.tape * cosine**light.tape_exponent
    if kind == PERSON:
        return light.people * cosine
    if kind == SHINY:
        off = math.acos(min(cosine, 1.0)) / light.shiny_lobe
        return light.wall * cosine + light.shiny * math.exp(-0.5 * off * off)
    return light.wall * cosine


@compiled_inline
def reported(strength: float, light: Light) -> float:
    """Intensity that the scanner reports of so much light, without noise.

    Parameters
    ----------
    strength : of the light, in the unit of the model's intensities.
    light : of the virtual world.

    Notes
    -----
    min(t (I / t)^g, largest) with the intensity t of tape: by definition, what is as bright as tape stays as it is.
    """
    if light.response == 1.0 or light.tape == 0.0:
        return min(strength, light.largest)
    return min(light.tape * (strength / light.tape) ** light.response, light.largest)


@compiled_inline
def mixed_echo(
    strengths: tuple[float, float, float], distances: tuple[float, float, float], length: float
) -> tuple[float, float]:
    """Range and intensity that a beam with up to three echoes measures [m, sensor's unit].

    Parameters
    ----------
    strengths : of each echo; 0: there is none.
    distances : of each [m].
    length : depth within which echoes become one [m].

    Notes
    -----
    d = sum I_k d_k / sum I_k over the echoes within the length of the strongest, by definition: a receiver that takes
    the center of its strongest pulse. Infinity and 0 where there is none.
    """
    strongest = 0
    for k in range(1, 3):
        if strengths[k] > strengths[strongest]:
            strongest = k
    if not strengths[strongest] > 0.0:
        return math.inf, 0.0
    total, moment = 0.0, 0.0
    for k in range(3):
        if strengths[k] > 0.0 and abs(distances[k] - distances[strongest]) <= length:
            total += strengths[k]
            moment += strengths[k] * distances[k]
    return moment / total, total
