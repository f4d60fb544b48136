"""A plain image (a scanned plan, a screenshot) as a floor map: two clicked pixels, a typed distance, a direction.

Images that state their own resolution and origin are read by `map_server`.
"""

from __future__ import annotations

import math
import struct
import warnings
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from commission.errors import FileFormatError
from commission.io.map_server import CELL_LIMIT, why_no_image
from commission.io.reading import check_size
from commission.site.checks import above, between
from commission.site.floor_map import FREE, OCCUPIED, FloorMap

FILE_LIMIT = 256_000_000
"""Bytes of an image."""
FORMATS = ("PNG", "JPEG", "BMP", "GIF", "TIFF", "PPM", "WEBP")

Pixel = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class ImagePlacement:
    """Where an image lies in the map: pixels (u, v) count from the outer corner at the top left, u right, v down."""

    first: Pixel
    """The pixel clicked first."""
    second: Pixel
    """The pixel clicked second."""
    distance: float
    """Distance between the two on the floor [m]."""
    direction: float = 0.0
    """Direction from the first to the second in the map frame [rad]: 0 makes their line the x axis."""
    first_in_map: tuple[float, float] = (0.0, 0.0)
    """Where the first lies in the map frame: x, y [m]."""

    def __post_init__(self) -> None:
        above(self.distance, 0.0, "distance", "m")
        numbers = (*self.first, *self.second, self.direction, *self.first_in_map)
        if not all(math.isfinite(number) for number in numbers):
            raise ValueError("a coordinate of the placement is not finite; expected numbers")
        if math.dist(self.first, self.second) < 1.0:
            raise ValueError("the two pixels lie less than a pixel apart; expected two distant points")
        above(self.resolution, 0.0, "resolution", "m per pixel")

    @property
    def resolution(self) -> float:
        """Edge of a pixel [m]."""
        return self.distance / math.dist(self.first, self.second)

    def origin(self, height: int) -> NDArray[np.float64]:
        """Pose of the lower-left corner of an image of that height [pixels]: (3,) array [m, m, rad], map frame."""
        (u1, v1), (u2, v2) = self.first, self.second
        # v counts downward and y upward, hence v1 - v2.
        yaw = self.direction - math.atan2(v1 - v2, u2 - u1)
        right, up = u1 * self.resolution, (height - v1) * self.resolution
        c, s = math.cos(yaw), math.sin(yaw)
        x, y = self.first_in_map
        return np.array([x - (c * right - s * up), y - (s * right + c * up), math.remainder(yaw, 2.0 * math.pi)])


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A plain image: gray values without a scale. Its two arrays are one where nothing is transparent."""

    on_white: NDArray[np.uint8]
    """(H, W) gray values, top row first; what is transparent shows white."""
    on_black: NDArray[np.uint8]
    """(H, W) gray values, top row first; what is transparent shows black."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [pixels]."""
        height, width = self.on_white.shape
        return width, height

    def walls(self, threshold: float = 0.5, *, light_walls: bool = False) -> NDArray[np.bool_]:
        """Which pixels are walls.

        Parameters
        ----------
        threshold : brightness [0..1] below which a pixel is a wall.
        light_walls : whether walls are light on dark: then pixels brighter than the threshold are walls.

        Returns
        -------
        walls : (H, W) array, top row first; transparent pixels are none.
        """
        between(threshold, (0.0, 1.0), "threshold")
        return self.on_black > 255.0 * threshold if light_walls else self.on_white < 255.0 * threshold

    def floor_map(self, placement: ImagePlacement, *, threshold: float = 0.5, light_walls: bool = False) -> FloorMap:
        """Return the picture as a floor map with one cell for each pixel.

        Parameters
        ----------
        placement : where it lies, and how large a pixel is.
        threshold, light_walls : as in `walls`.
        """
        walls = self.walls(threshold, light_walls=light_walls)
        cells = np.where(np.flipud(walls), np.int8(OCCUPIED), np.int8(FREE))
        return FloorMap(cells, placement.resolution, placement.origin(len(cells)))


def read_picture(path: Path) -> Picture:
    """Read an image.

    Parameters
    ----------
    path : image file in one of `FORMATS`.

    Raises
    ------
    FileFormatError
        the file is missing, no image, truncated or too large; too large is found out before it is unpacked.
    """
    check_size(path, FILE_LIMIT)
    try:
        with warnings.catch_warnings():
            # Pillow warns about large images and odd metadata; the limit that counts is CELL_LIMIT.
            warnings.simplefilter("ignore")
            with Image.open(path, formats=FORMATS) as image:
                width, height = image.size
                if not 0 < width * height <= CELL_LIMIT:
                    raise FileFormatError(path, "", f"has {width} x {height} pixels", f"1 to {CELL_LIMIT} pixels")
                return _picture(image)
    except FileFormatError:
        raise
    except Image.DecompressionBombError as error:
        raise FileFormatError(path, "", "is too large", f"1 to {CELL_LIMIT} pixels") from error
    except (OSError, ValueError, SyntaxError, EOFError, OverflowError, struct.error, zlib.error, LookupError) as error:
        # What Pillow raises for garbage and for files that end early depends on format and place.
        raise FileFormatError(
            path, "", f"is no readable image ({why_no_image(error, path)})", f"one of: {', '.join(FORMATS)}"
        ) from error


def _picture(image: Image.Image) -> Picture:
    if image.mode.startswith("I") or image.mode == "F":
        # 16 bits a pixel: Pillow's own conversion would cut off at 255 instead of scaling.
        pixels = np.asarray(image, dtype=np.float64)
        full_scale = 65535.0 if pixels.max(initial=0.0) > 255.0 else 255.0
        gray = (np.clip(pixels / full_scale, 0.0, 1.0) * 255.0).astype(np.uint8)
        return Picture(gray, gray)
    if "A" in image.getbands() or "transparency" in image.info:
        image = image.convert("RGBA")
        return Picture(_gray_on(image, 255), _gray_on(image, 0))
    gray = np.asarray(image.convert("L"))
    return Picture(gray, gray)


def _gray_on(image: Image.Image, ground: int) -> NDArray[np.uint8]:
    """(H, W) gray values of an image with transparency on a ground of that gray."""
    canvas = Image.new("RGBA", image.size, (ground, ground, ground, 255))
    return np.asarray(Image.alpha_composite(canvas, image).convert("L"))
