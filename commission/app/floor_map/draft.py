"""A floor map that is being loaded: the file, what was read of it, and what it leaves open. Frozen; no widget."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path, PurePath
from typing import Annotated, TypeAlias

from commission.app.base.actions import Point
from commission.app.base.uploads import Upload
from commission.io.dxf import Drawing
from commission.io.dxf_units import UNITS
from commission.io.image_map import ImagePlacement, Picture
from commission.io.mesh import KINDS as MODEL_KINDS
from commission.io.mesh import Model
from commission.site.checks import check_fields
from commission.site.quantity import (
    COORDINATE,
    DEGREES,
    MILLIMETRES,
    PERCENT,
    POSITIVE,
    SHARE,
    Bounds,
    Quantity,
    Switch,
)

MAP_ENDINGS = ("yaml", "yml")
DRAWING_ENDINGS = ("dxf",)
PICTURE_ENDINGS = ("png", "jpg", "jpeg", "bmp", "gif", "tif", "tiff", "pgm", "ppm", "webp")
ENDINGS = (*MAP_ENDINGS, *PICTURE_ENDINGS, *DRAWING_ENDINGS, *MODEL_KINDS)
HIGHEST = 100.0
"""Height of a section beyond which nobody mounts a scanner [m]."""

Pixel: TypeAlias = tuple[float, float]
"""A place in a picture, from the outer corner at its top left: right, down [pixels]."""
Read: TypeAlias = Drawing | Model | Picture


@dataclass(frozen=True, slots=True)
class MapFile:
    """A file to load a floor map from."""

    source: Path | Upload
    """Path on this computer, or what a browser sent."""

    @property
    def name(self) -> str:
        """What the file is called; somebody else's words."""
        return self.source.name

    @property
    def ending(self) -> str:
        """What kind of file it says it is, in lower case and without the dot."""
        return PurePath(self.name).suffix.lower().removeprefix(".")


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """What has to be known to read a drawing or a model."""

    unit: str = ""
    """Unit in which it was made; empty: as a drawing says, metres for a model."""
    up: str = ""
    """Axis of a model that points up, y or z; empty: as its format has it."""

    def __post_init__(self) -> None:
        if self.unit and self.unit not in UNITS:
            raise ValueError(f"unit is {self.unit!r}; expected one of: {', '.join(UNITS)}")
        if self.up not in ("", "y", "z"):
            raise ValueError(f"axis is {self.up!r}; expected y or z")


@dataclass(frozen=True, slots=True, kw_only=True)
class MapOptions:
    """What a file leaves open."""

    resolution: Annotated[
        float, Quantity(label="Cell", unit="m", shown=MILLIMETRES, bounds=Bounds.between(0.001, 1.0), step=1.0)
    ] = 0.05
    """Edge of a cell of the map."""
    layers: tuple[str, ...] | None = None
    """Layers of a drawing that hold walls; none: those that are visible."""
    heights: Annotated[
        tuple[float, ...], Quantity(label="Cut at", unit="m", bounds=Bounds.between(-HIGHEST, HIGHEST))
    ] = (0.2,)
    """Heights at which a model is cut, those of scanner and reflectors: 0.2 1.8"""
    threshold: Annotated[
        float, Quantity(label="Walls from", shown=PERCENT, bounds=SHARE, step=1.0, slider=(0.0, 100.0))
    ] = 0.5
    """Brightness of a picture at which walls end."""
    light_walls: Annotated[bool, Switch("Walls are")] = False
    """Whether walls are lighter than the floor."""
    distance: Annotated[float, Quantity(label="A to B", unit="m", bounds=POSITIVE)] = 10.0
    """Distance between the two points that were clicked."""
    direction: Annotated[float, Quantity(label="Heading", unit="rad", shown=DEGREES, step=0.01)] = 0.0
    """Direction from the first to the second point, map frame; 0 is along x."""
    first_in_map: Annotated[Point, Quantity(label="A is at", unit="m", bounds=COORDINATE)] = (0.0, 0.0)
    """Where the first point lies, x and y in the map frame."""

    def __post_init__(self) -> None:
        check_fields(self)
        if not 0 < len(self.heights) <= 20:
            raise ValueError(f"{len(self.heights)} heights are given; expected 1 to 20")


@dataclass(frozen=True, slots=True)
class Stage:
    """Where a picture without a scale is shown for clicking on it."""

    pixel: float
    """Edge of a pixel as it is shown [m]."""
    left: float
    """x of its left edge [m]."""
    top: float
    """y of its top edge [m]."""

    def pixel_at(self, place: Point) -> Pixel:
        """Return which pixel is shown at a place [m]."""
        return (place[0] - self.left) / self.pixel, (self.top - place[1]) / self.pixel

    def place_of(self, pixel: Pixel) -> Point:
        """Return where a pixel is shown [m]."""
        return self.left + pixel[0] * self.pixel, self.top - pixel[1] * self.pixel


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MapDraft:
    """A file that was read and waits for what it leaves open."""

    file: MapFile
    """The file."""
    read: Read
    """What was read of it."""
    reading: ReadOptions = ReadOptions()
    """How it was read."""
    options: MapOptions = MapOptions()
    """What the engineer has chosen."""
    pixels: tuple[Pixel, ...] = ()
    """Points of a picture that were clicked, at most two."""
    stage: Stage = Stage(1.0, 0.0, 0.0)
    """Where a picture is shown meanwhile."""

    def placement(self) -> ImagePlacement | None:
        """Return where a picture comes to lie; none before two points were clicked."""
        if len(self.pixels) < 2:
            return None
        first, second = self.pixels
        options = self.options
        return ImagePlacement(
            first=first,
            second=second,
            distance=options.distance,
            direction=options.direction,
            first_in_map=options.first_in_map,
        )

    def clicked(self, place: Point) -> MapDraft:
        """Return the draft after a click on its picture: the first, then the second point, then the nearer is moved.

        Raises
        ------
        ValueError
            the click missed the picture.
        """
        if not isinstance(self.read, Picture):
            return self
        pixel, (width, height) = self.stage.pixel_at(place), self.read.size
        if not (0.0 <= pixel[0] <= width and 0.0 <= pixel[1] <= height):
            raise ValueError("the click missed the image; expected a point of it")
        pixels = self.pixels
        if len(pixels) == 2:
            nearer = min((0, 1), key=lambda index: math.dist(pixels[index], pixel))
            pixels = tuple(pixel if index == nearer else kept for index, kept in enumerate(pixels))
            return replace(self, pixels=pixels)
        return replace(self, pixels=(*pixels, pixel))


@dataclass(frozen=True, slots=True)
class WaitingMap:
    """A `map_server` YAML file that was sent without its image."""

    file: MapFile
    """The YAML file."""
    image: str
    """What it calls its image."""


@dataclass(frozen=True, slots=True)
class MapLoading:
    """What is under way with the floor map, for all browsers."""

    draft: MapDraft | None = None
    """The file that was read."""
    waiting: WaitingMap | None = None
    """A map whose image has not come yet."""
    image: MapFile | None = None
    """The image that came last: a YAML file that comes after it may mean it."""
    notes: tuple[str, ...] = ()
    """What was loaded, and what was left out or assumed on the way."""


@dataclass(frozen=True, slots=True)
class MapTrouble:
    """Why what one browser asked for did not become a floor map: it may quote a file, which is nobody else's business.

    A file that can be read is everybody's work (`MapLoading`), like the map that is made of it.
    """

    text: str = ""
    """In one line; empty: nothing went wrong."""
