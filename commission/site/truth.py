"""What is true in one virtual drive: the constants that were drawn for its seed. Nothing of the filter is in it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Annotated

from commission.site.disturbances import ScannerError, WheelNoise
from commission.site.fields import described
from commission.site.quantity import DEGREES, MILLIMETRES, PERCENT, Quantity


def _share(label: str) -> Quantity:
    return Quantity(label=label, shown=PERCENT, step=0.001)


_OFF = Quantity(label="Off by", unit="m", shown=MILLIMETRES, step=0.1)


@dataclass(frozen=True, slots=True, kw_only=True)
class TrueWheels:
    """How the wheels of a virtual vehicle report its motion."""

    noise: WheelNoise = field(default_factory=WheelNoise)
    """Their noise."""
    forward_scale: Annotated[float, _share("All too small")] = 0.0
    """Share by which all wheels together report too much way."""
    wheel_scales: Annotated[tuple[float, ...], _share("Alone too small")] = ()
    """Share by which each driven wheel alone reports too much way; none: all are as they should be."""
    separation_scale: Annotated[float, _share("Farther apart")] = 0.0
    """Share by which the true distance between the wheels is larger than the vehicle's."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TruePlace:
    """Where a reflector truly stands."""

    id: str
    """Its name in the map."""
    dx: Annotated[float, _OFF]
    """True x less the map's."""
    dy: Annotated[float, _OFF]
    """True y less the map's."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrueTag:
    """Where a tag truly stands."""

    id: str
    """Its id in the map."""
    dx: Annotated[float, _OFF]
    """True x less the map's."""
    dy: Annotated[float, _OFF]
    """True y less the map's."""
    turn: Annotated[float, Quantity(label="Turned by", unit="rad", shown=DEGREES, step=0.01)]
    """True heading less the map's."""


TAG_CAMERA = "tag camera"
"""What the camera that looks for tags is called."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """All constants of one virtual drive."""

    seed: int = 0
    """Seed of the drive."""
    route: str = ""
    """Route that was driven."""
    wheels: TrueWheels = field(default_factory=TrueWheels)
    """Noise and scale of the wheels."""
    scanners: tuple[ScannerError, ...] = ()
    """Errors of each scanner: what was drawn, and what the project says of it."""
    reflectors: tuple[TruePlace, ...] = ()
    """Reflectors that do not stand where the map says."""
    tags: tuple[TrueTag, ...] = ()
    """Tags that do not stand where the map says."""
    tag_camera: ScannerError = field(default_factory=lambda: ScannerError(scanner=TAG_CAMERA))
    """Errors of the camera that looks for them."""


def truth_told(truth: Truth) -> list[tuple[str, str]]:
    """Say what is true in a drive, as people read it: of what is spoken, and its values with their units."""
    wheels = [*_numbers(truth.wheels.noise), *_numbers(truth.wheels)]
    told = [("wheels", ", ".join(wheels) or "without errors")]
    for scanner in truth.scanners:
        told.append((scanner.scanner, ", ".join(_numbers(scanner)) or "as the project says"))
    if truth.reflectors:
        off = [math.hypot(place.dx, place.dy) for place in truth.reflectors]
        rms, most = math.sqrt(sum(each**2 for each in off) / len(off)), max(off)
        farthest = truth.reflectors[off.index(most)].id
        text = f"{len(off)} off, {_OFF.text(rms)} RMS, {_OFF.text(most)} at most ({farthest})"
        told.append(("reflectors", text))
    else:
        told.append(("reflectors", "where the map says"))
    if truth.tags:
        most = max(truth.tags, key=lambda tag: math.hypot(tag.dx, tag.dy))
        told.append(("tags", f"{len(truth.tags)} off, {_OFF.text(math.hypot(most.dx, most.dy))} at most ({most.id})"))
    if of_camera := ", ".join(_numbers(truth.tag_camera)):
        told.append((TAG_CAMERA, of_camera))
    return told


def truth_lines(truth: Truth) -> list[str]:
    """Say what is true in a drive, one thing a line."""
    return [f"{what}: {text}" for what, text in truth_told(truth)]


def _numbers(value: WheelNoise | TrueWheels | ScannerError) -> Iterator[str]:
    """Label, number and unit of each number of a value that is not zero."""
    for name, descriptions in described(type(value)):
        content = getattr(value, name)
        numbers = content if isinstance(content, tuple) else (content,)
        for number, beside in zip(numbers, itertools.cycle(descriptions), strict=False):
            if isinstance(beside, Quantity) and number:
                yield f"{beside.label[0].lower()}{beside.label[1:]} {beside.text(number)}"
