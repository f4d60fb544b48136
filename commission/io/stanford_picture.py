"""The Stanford diagram as a picture: cycles by true error and protection level, its regions named and counted."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from commission.studies.stanford import CELLS, CELLS_PER_LIMIT, StanfordDiagram

SIZE = (9.6, 7.2)
"""Width and height [inches] at 100 dots each."""
_HAZARD, _MISLEADING, _ALARM = "#d1242f", "#e0a100", "#8a929c"


def picture_of(diagram: StanfordDiagram) -> bytes:
    """Return the picture as PNG.

    Parameters
    ----------
    diagram : cycles by error and protection level; the last cells, beyond twice the limit, are drawn at the edge.
    """
    # It takes a second to import, and needs no window.
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.colors import LogNorm
    from matplotlib.figure import Figure

    limit = 1e3 * diagram.limit
    edges = np.arange(CELLS + 2) * limit / CELLS_PER_LIMIT
    end = float(edges[-1])
    figure = Figure(figsize=SIZE, dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    axes.fill([limit, end, end, limit], [0, 0, limit, limit], color=_HAZARD, alpha=0.16, linewidth=0)
    axes.fill([0, limit, limit], [0, 0, limit], color=_MISLEADING, alpha=0.16, linewidth=0)
    axes.fill([0, end, end, 0], [limit, limit, end, end], color=_ALARM, alpha=0.16, linewidth=0)
    counts = np.ma.masked_equal(diagram.counts.T, 0)
    mesh = axes.pcolormesh(edges, edges, counts, norm=LogNorm(vmin=1, vmax=max(2, int(diagram.counts.max()))))
    figure.colorbar(mesh, ax=axes, label="cycles")
    axes.plot([0, end], [0, end], color="#20242a", linewidth=1)
    axes.axhline(limit, color="#20242a", linewidth=1, linestyle="--")
    axes.plot([limit, limit], [0, limit], color="#20242a", linewidth=1, linestyle="--")
    _name_regions(axes, diagram, limit)
    axes.set(
        xlim=(0, end),
        ylim=(0, end),
        xlabel="true position error [mm]; last column: beyond twice the limit",
        ylabel="protection level (2σ of the supervisor) [mm]; last row: beyond",
        title=f"Stanford diagram, {diagram.regions.total} cycles, alarm limit {limit:g} mm",
    )
    written = io.BytesIO()
    figure.savefig(written, format="png")
    return written.getvalue()


def _name_regions(axes: Any, diagram: StanfordDiagram, limit: float) -> None:
    """Write each region's name, count and share into it."""
    regions = diagram.regions
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 2.0}
    places = {
        "nominal": (0.06, 0.80, regions.nominal),
        "misleading": (0.62, 0.12, regions.misleading),
        f"hazardously misleading\n({diagram.verdicts.hazardous} while operational)": (1.5, 0.5, regions.hazardous),
        "unavailable\n(false alarm up to the limit)": (0.55, 1.7, regions.unavailable),
        "unavailable,\nmisleading": (1.72, 1.3, regions.unavailable_misleading),
    }
    for name, (x, y, count) in places.items():
        text = f"{name}\n{count} ({100.0 * count / max(regions.total, 1):.3g} %)"
        align = "left" if x < 0.1 else "center"
        axes.text(x * limit, y * limit, text, ha=align, va="center", fontsize=9, bbox=box)
