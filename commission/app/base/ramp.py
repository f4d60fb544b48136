"""The ramp of colors for values that grow, and how a legend shows one; after matplotlib's viridis.

Its colors grow evenly in lightness and are told apart by color-blind people.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# Anchors of viridis (van der Walt & Smith 2015, public domain), dark to bright.
ANCHORS = np.array(
    [
        (68, 1, 84),
        (71, 44, 122),
        (59, 81, 139),
        (44, 113, 142),
        (33, 144, 141),
        (39, 173, 129),
        (92, 200, 99),
        (170, 220, 50),
        (253, 231, 37),
    ],
    dtype=np.float64,
)


def colors(count: int) -> NDArray[np.uint8]:
    """Return `count` colors from dark to bright in even steps: (count, 3) array."""
    at = np.linspace(0.0, len(ANCHORS) - 1.0, count)
    return np.stack([np.interp(at, np.arange(len(ANCHORS)), channel) for channel in ANCHORS.T], axis=1).astype(np.uint8)


def ramp_html(colors: list[str], bounds: list[str], names: list[str] | None = None) -> str:
    """Return a row of colors for a legend.

    Parameters
    ----------
    colors : CSS color of each class.
    bounds : what is written where two classes meet.
    names : what is written under each class instead.
    """
    share = 100.0 / len(colors)
    blocks = "".join(f"<span style='flex:1;height:14px;background:{color}'></span>" for color in colors)
    labels = "".join(
        f"<span style='position:absolute;left:{(index + 1) * share:.2f}%;transform:translateX(-50%)'>{bound}</span>"
        for index, bound in enumerate(bounds)
    )
    if names is not None:
        labels = f"<div style='display:flex'>{''.join(cell_html(name) for name in names)}</div>"
    return (
        f"<div style='display:flex;padding-top:4px'>{blocks}</div>"
        f"<div style='position:relative;height:13px;font-size:10px;opacity:.9'>{labels}</div>"
    )


def cell_html(text: str) -> str:
    """Return one of several texts that share a row evenly."""
    return f"<span style='flex:1;text-align:center'>{text}</span>"


def scales_html(content: str) -> str:
    """Return the frame around the scales of one feature; nothing around nothing."""
    return content and f"<div class='c-scales' style='font-size:12px;padding:2px 6px 6px'>{content}</div>"
