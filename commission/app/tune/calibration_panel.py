"""In the step Tune: calibrates by the drive that is shown, and lets figures be accepted one by one."""

from __future__ import annotations

from viser import GuiApi

from commission.app.base import theme
from commission.app.base.actions import Action
from commission.app.base.inputs import Text, WorkBar, enable, show
from commission.app.base.panel import BasePanel, Post, posting, shortened, write_label
from commission.app.base.rows import Rows
from commission.app.base.view import PageView
from commission.app.tune.calibration_actions import AcceptFigure, CalibrateByDrive, DropCalibration, LookAtFigure
from commission.app.tune.calibration_service import CALIBRATION
from commission.app.tune.calibration_state import CalibrationState
from commission.app.tune.calibration_texts import figure_text, gain_text, not_proposed_text, summary_text
from commission.app.tune.calibration_view import CalibrationView, ProposedFigure
from commission.studies.calibration_words import change_of, label_of

LONGEST_LABEL = 30


class CalibrationPanel(BasePanel):
    """Button, progress, the figure that is looked at, and lists of all.

    Parameters
    ----------
    gui, post : where the widgets are made, what takes their actions.
    """

    def __init__(self, gui: GuiApi, post: Post) -> None:
        self._shown: CalibrationView | None = None
        self._ask = gui.add_button(
            "Calibrate by this drive",
            hint="Noise, bias, mountings, clocks, wheels and reflectors, by the drive shown. Its reference is unread.",
        )
        self._ask.on_click(posting(post, lambda _event: CalibrateByDrive()))
        self._work = WorkBar(gui, post, CALIBRATION, DropCalibration())
        self._summary = Text(gui)
        self._figure = Text(gui)
        self._accept = gui.add_button("Accept", visible=False, hint="One undo step; the drive is localized again.")
        self._accept.on_click(posting(post, self._accepted))
        self._gain = Text(gui)
        self._proposed = gui.add_folder("Proposed by the drive", visible=False)
        with self._proposed:
            self._rows = Rows(gui, self._proposed, post, self._looked_at)
        self._others = gui.add_folder("Not proposed, and why", visible=False)
        with self._others:
            self._not_proposed = Text(gui)
        self._drop = gui.add_button(
            "Discard calibration", color="gray", visible=False, hint="What was accepted of it stays."
        )
        self._drop.on_click(posting(post, lambda _event: DropCalibration()))

    def _accepted(self, _event: object) -> Action:
        """Accept what is shown; it may have been dropped since it was drawn."""
        found = self._shown
        if found is None or found.chosen is None:
            return DropCalibration() if found is None else LookAtFigure("")
        return AcceptFigure(found.chosen.value.key, found.calibration)

    def _looked_at(self, index: int) -> Action:
        """Look at a line; the list may have become shorter since it was drawn."""
        found = self._shown
        known = found is not None and index < len(found.proposed)
        return LookAtFigure(found.proposed[index].value.key if found is not None and known else "")

    def draw_slowly(self, view: PageView) -> None:
        """Follow progress, what was found, and what the project says by now."""
        asked, found = view.state.part(CalibrationState), view.part(CalibrationView)
        why_not = "" if asked.shown is not None else "no drive is shown that is over"
        enable(self._ask, "a calibration is under way" if self._work.follow(view) else why_not)
        if found is self._shown:
            return
        self._shown = found
        self._summary.write((found,), lambda: "" if found is None else summary_text(found))
        self._figure.write((found,), lambda: "" if found is None else figure_text(found))
        self._gain.write((found,), lambda: "" if found is None else gain_text(found))
        self._not_proposed.write((found,), lambda: "" if found is None else not_proposed_text(found))
        self._follow_accept(found)
        self._rows.show([] if found is None else [_line(each, found.chosen) for each in found.proposed])
        show(self._proposed, visible=found is not None and bool(found.proposed))
        for widget in (self._others, self._drop):
            show(widget, visible=found is not None)

    def _follow_accept(self, found: CalibrationView | None) -> None:
        """Say on the button what it accepts, or why it cannot."""
        chosen = None if found is None else found.chosen
        show(self._accept, visible=chosen is not None)
        if found is None or chosen is None:
            return
        write_label(self._accept, f"Accept {shortened(label_of(chosen.value.key), LONGEST_LABEL)}")
        why_not = "it is accepted" if chosen.is_accepted else ""
        if chosen.now is None:
            why_not = "the project has no such scanner or reflector any more"
        if not found.is_of_drive:
            why_not = "another drive is shown than the one that was calibrated by"
        enable(self._accept, why_not)


def _line(figure: ProposedFigure, chosen: ProposedFigure | None) -> tuple[str, theme.Color]:
    """A figure, its change, and whether it is accepted."""
    mark = "✓ " if figure.is_accepted else ""
    color = theme.CHOSEN_LINE if figure is chosen else theme.LINE
    return f"{mark}{label_of(figure.value.key)}: {change_of(figure.value)}", color
