"""The light theme: each color of `paints` is put in the place of its dark one on the way to a browser that asks for it.

Whoever draws says dark colors only, and nothing is drawn twice: all browsers share one scene, and each sees it in the
theme that its own cookie asks for.
"""

from __future__ import annotations

import copy
import io
import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from commission.app.base.paints import PAINTS, Color

COOKIE = "commission_theme"
"""Of the browser; `light` asks for the light theme (web_assets/daylight.js)."""
MOST_PICTURES = 64
"""Pictures whose light ones are kept: a tile of a floor map is asked for once by each browser."""

_LIGHT = {paint.dark: paint.light for paint in PAINTS.values()}
_HEX = re.compile(r"#([0-9a-f]{6})\b", re.IGNORECASE)
_RGB = re.compile(r"(?<=rgb\(|gba\()(\d{1,3}), ?(\d{1,3}), ?(\d{1,3})")


def wants_light(cookies: str | None) -> bool:
    """Whether the cookies of a browser ask for the light theme."""
    return cookies is not None and f"{COOKIE}=light" in cookies.replace(" ", "").split(";")


@lru_cache(maxsize=4096)
def light_color(color: Color) -> Color:
    """Return a color in the light theme.

    What no paint has, is one of a ramp: there it is as much darker as it is brighter, and the order stays.

    Parameters
    ----------
    color : red, green and blue of the dark theme [0..255].
    """
    if color in _LIGHT:
        return _LIGHT[color]
    linear = np.array([v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in np.array(color) / 255.0])
    # Luminance after WCAG 2.1. Y (1 - 0.55 Y) grows all the way from 0 to 0.9.
    linear *= 1.0 - 0.55 * float(linear @ (0.2126, 0.7152, 0.0722))
    shown = [12.92 * v if v <= 0.0031308 else 1.055 * v ** (1.0 / 2.4) - 0.055 for v in linear]
    red, green, blue = (round(255.0 * v) for v in shown)
    return red, green, blue


@lru_cache(maxsize=512)
def light_text(text: str) -> str:
    """Return html, style or script with its colors in the light theme; `#fff` and other short ones stay."""

    def of_hex(found: re.Match[str]) -> str:
        digits = found[1]
        red, green, blue = light_color((int(digits[:2], 16), int(digits[2:4], 16), int(digits[4:], 16)))
        return f"#{red:02x}{green:02x}{blue:02x}"

    def of_rgb(found: re.Match[str]) -> str:
        return "{},{},{}".format(*light_color((int(found[1]), int(found[2]), int(found[3]))))

    return _RGB.sub(of_rgb, _HEX.sub(of_hex, text))


def light_array(colors: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return (..., 3) or (..., 4) colors in the light theme; how opaque they are stays.

    Parameters
    ----------
    colors : of lines, points or pixels [0..255].
    """
    flat = np.ascontiguousarray(colors[..., :3]).reshape(-1, 3).astype(np.int64)
    codes = (flat[:, 0] << 16) | (flat[:, 1] << 8) | flat[:, 2]
    found, where = np.unique(codes, return_inverse=True)
    table = np.array([light_color((code >> 16, code >> 8 & 255, code & 255)) for code in found.tolist()], np.uint8)
    light = colors.copy()
    light[..., :3] = table.reshape(-1, 3)[where].reshape(*colors.shape[:-1], 3)
    return light


@lru_cache(maxsize=MOST_PICTURES)
def light_picture(picture: bytes) -> bytes:
    """Return a PNG in the light theme; of another format it stays as it is."""
    if not picture.startswith(b"\x89PNG"):
        return picture
    with Image.open(io.BytesIO(picture)) as opened:
        pixels = np.array(opened.convert("RGBA" if "A" in opened.getbands() else "RGB"))
    light = io.BytesIO()
    Image.fromarray(light_array(pixels)).save(light, "PNG", compress_level=1)
    return light.getvalue()


def light_message(message: Any) -> Any:
    """Return what is on its way to a browser in the light theme: a copy where it has colors.

    Parameters
    ----------
    message : of viser; others get it as it is, and it is not changed.
    """
    parts = vars(message)
    changed: dict[str, Any] = {}
    if "dark_mode" in parts:
        changed["dark_mode"] = False
    for name in ("props", "updates", "source", "rgb_data"):
        if parts.get(name) is not None:
            changed[name] = _light_part(name, parts[name])
    changed = {name: value for name, value in changed.items() if value is not parts[name]}
    if not changed:
        return message
    light = copy.copy(message)
    for name, value in changed.items():
        setattr(light, name, value)
    return light


def _light_part(name: str, part: Any) -> Any:
    """Part of a message: properties, a script, or a picture."""
    if isinstance(part, str):
        return light_text(part)
    if isinstance(part, bytes):
        return light_picture(part)
    fields: Mapping[str, Any] = cast("Mapping[str, Any]", part) if name == "updates" else vars(part)
    changed = {key: light for key, value in fields.items() if (light := _light_field(key, value)) is not value}
    if not changed:
        return part
    if name == "updates":
        return {**fields, **changed}
    light = copy.copy(part)
    for key, value in changed.items():
        setattr(light, key, value)
    return light


def _light_field(name: str, value: Any) -> Any:
    """One property of a node or a widget: its colors, its html, its picture, or how its curves are drawn."""
    if value is None:
        return value
    if "color" in name:
        if isinstance(value, np.ndarray):
            return light_array(cast("NDArray[np.uint8]", value))
        return light_color(cast("Color", value)) if isinstance(value, tuple) else value
    if name == "content" and isinstance(value, str):
        return light_text(value)
    if name == "_data" and isinstance(value, bytes):
        return light_picture(value)
    return _light_style(value) if name in ("series", "axes") else value


def _light_style(value: Any) -> Any:
    """How curves and axes of viser's plots are drawn."""
    if isinstance(value, str):
        return light_text(value)
    if isinstance(value, dict):
        return {key: _light_style(each) for key, each in cast("dict[str, Any]", value).items()}
    if isinstance(value, tuple | list):
        return tuple(_light_style(each) for each in cast("tuple[Any, ...]", value))
    return value
