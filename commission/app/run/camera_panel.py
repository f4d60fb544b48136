"""The step Run: what the contour in a camera tells of its motion and its place; nothing where there is none."""

from __future__ import annotations

from viser import GuiApi

from commission.app.base.inputs import Text
from commission.app.base.panel import BasePanel, escaped, table
from commission.app.base.view import PageView
from commission.site.quantity import DEGREES, MILLIMETRES, PERCENT
from commission.studies.vision import Constant, VisionResult, summary

PLACES = (
    ("Camera ahead of base", "forward"),
    ("Camera left of base", "left"),
    ("Camera faces", "yaw"),
    ("Contour's first depth", "depth"),
)


class CameraPanel(BasePanel):
    """Figures of both tracks of the camera."""

    def __init__(self, gui: GuiApi) -> None:
        self._html = Text(gui)

    def draw_slowly(self, view: PageView) -> None:
        """Follow the tracks."""
        found = view.part(VisionResult)
        self._html.write((found,), lambda: "" if found is None else camera_html(found))


def camera_html(found: VisionResult) -> str:
    """Return the figures, each with its 1-sigma, and what looks wrong."""
    entries = summary(found)
    ahead, left, share = (
        float(str(entries[f"difference_{key}"])) for key in ("forward_rms_m", "left_rms_m", "share_of_motion")
    )
    rows = [
        (
            "Difference to the laser",
            f"{MILLIMETRES.text(ahead, '.1f')} ahead, {MILLIMETRES.text(left, '.1f')} sideways",
        ),
        ("&nbsp;&nbsp;of the motion", PERCENT.text(share, ".1f")),
        *((label, _with_sigma(found.constant(name))) for label, name in PLACES),
    ]
    notes = "".join(f"<div class='c-note'>{escaped(finding)}</div>" for finding in found.findings)
    title = f"<b>Camera by its contour</b>, {len(found.stamps_ns)} frames; ± is 1-sigma"
    return f"<div class='c-camera' style='padding:2px 6px'>{title}{table(rows)}{notes}</div>"


def _with_sigma(constant: Constant) -> str:
    shown, form = (MILLIMETRES, ".0f") if constant.unit == "m" else (DEGREES, ".2f")
    return f"{shown.number(constant.value, form)} ± {shown.text(constant.sigma, form)}"
