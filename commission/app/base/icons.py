"""Icons of a few lines, drawn in the color of the words around them."""

from __future__ import annotations

from urllib.parse import quote


def mask(path: str) -> str:
    """Return lines as a picture to cut out of a color, for a style.

    Parameters
    ----------
    path : of an SVG, in a square of 24.
    """
    svg = (
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 24 24'><path fill='none' stroke='black' "
        f"stroke-width='1.7' stroke-linecap='round' stroke-linejoin='round' d='{path}'/></svg>"
    )
    return f'url("data:image/svg+xml,{quote(svg)}")'
