"""In the step Tune: what the drive shows of the reflector map, each with a tick, and one correction by all ticked."""

from __future__ import annotations

from typing import Any

from viser import GuiApi, GuiInputHandle

from commission.app.base.actions import Action
from commission.app.base.inputs import Text, WorkBar, enable, show
from commission.app.base.panel import BasePanel, Post, escaped, posting, write, write_label
from commission.app.base.view import PageView
from commission.app.tune.calibration_state import CalibrationState
from commission.app.tune.map_check import CheckMap, CorrectMap, DropMapCheck, TickFinding
from commission.app.tune.map_check_service import MAP_CHECK, FindingLine, MapCheckView
from commission.site.quantity import counted_text
from commission.studies.map_findings import MapFault, MapFinding


class MapCheckPanel(BasePanel):
    """Button, progress, a tick with its evidence for each finding, what would change, and the correction.

    Parameters
    ----------
    gui, post : where the widgets are made, what takes their actions.
    """

    def __init__(self, gui: GuiApi, post: Post) -> None:
        self._gui, self._post = gui, post
        self._shown: MapCheckView | None = None
        self._ask = gui.add_button(
            "Check the map by this drive",
            hint="Reflectors moved, missing, dirty or seen twice, and what is seen where none is mapped.",
        )
        self._ask.on_click(posting(post, lambda _event: CheckMap()))
        self._work = WorkBar(gui, post, MAP_CHECK, DropMapCheck())
        self._summary = Text(gui)
        self._list = gui.add_folder("Found in the map", visible=False)
        self._ticks: list[GuiInputHandle[Any]] = []
        self._texts: list[Text] = []
        self._changes = Text(gui)
        self._correct = gui.add_button("Correct the map", visible=False, hint="One undo step for all that are ticked.")
        self._correct.on_click(posting(post, self._corrected))
        self._drop = gui.add_button(
            "Discard findings", color="gray", visible=False, hint="What was corrected of the map stays."
        )
        self._drop.on_click(posting(post, lambda _event: DropMapCheck()))

    def draw_slowly(self, view: PageView) -> None:
        """Follow progress, what was found, and what the map says by now."""
        found, is_shown = view.part(MapCheckView), view.state.part(CalibrationState).shown is not None
        why_not = "" if is_shown else "no drive is shown that is over"
        enable(self._ask, "it is under way" if self._work.follow(view) else why_not)
        if found is self._shown:
            return
        self._shown = found
        lines = () if found is None else found.lines
        self._summary.write((found,), lambda: "" if found is None else summary_text(found))
        with self._list:
            while len(self._ticks) < len(lines):
                self._add(len(self._ticks))
        for number, tick in enumerate(self._ticks):
            self._write(tick, self._texts[number], lines[number] if number < len(lines) else None)
        show(self._list, visible=bool(lines))
        self._changes.write((found,), lambda: "" if found is None else changes_text(found.ticked))
        self._follow_correct(found)
        show(self._drop, visible=found is not None)

    def _add(self, number: int) -> None:
        """Make one more tick with room for its evidence."""
        tick = self._gui.add_checkbox(" ", False)
        tick.on_update(posting(self._post, lambda event: self._ticked(number, wanted=bool(event.target.value))))
        self._ticks.append(tick)
        self._texts.append(Text(self._gui))

    def _write(self, tick: GuiInputHandle[Any], text: Text, line: FindingLine | None) -> None:
        """Show one finding, or nothing."""
        show(tick, visible=line is not None)
        text.write((line,), lambda: "" if line is None else evidence_text(line))
        if line is not None:
            label = f"{line.finding.id}: {line.finding.fault.value}"
            if tick.label != label:
                tick.label = label
            write(tick, line.is_ticked)
            enable(tick, line.why_not)

    def _follow_correct(self, found: MapCheckView | None) -> None:
        """Say on the button how much it corrects, or why it cannot."""
        show(self._correct, visible=found is not None and bool(found.lines))
        if found is not None:
            write_label(self._correct, f"Correct the map ({len(found.ticked)})")
            why_not = "" if found.ticked else "nothing is ticked"
            enable(self._correct, why_not if found.is_of_drive else "another drive is shown than the one looked at")

    def _ticked(self, number: int, *, wanted: bool) -> Action:
        """Turn a tick; the list may have become shorter since it was drawn."""
        found = self._shown
        if found is None or number >= len(found.lines):
            return DropMapCheck()
        return TickFinding(found.lines[number].finding.id, wanted)

    def _corrected(self, _event: object) -> Action:
        """Correct by what is ticked; it may have been dropped since it was drawn."""
        return CorrectMap(()) if self._shown is None else CorrectMap(self._shown.ticked)


def summary_text(found: MapCheckView) -> str:
    """Say how much was found, and of what the drive tells nothing."""
    count = len(found.lines)
    notes = [f"{counted_text(count, 'finding')}." if count else "Every reflector in sight stands as mapped."]
    if found.found.unseen:
        notes.append(f"Hardly in sight on this drive, so nothing is said of: {', '.join(found.found.unseen)}.")
    if not found.is_of_drive:
        notes.append("Another drive is shown by now: check again.")
    return "".join(f"<div class='c-note' style='padding:2px 10px 2px 6px'>{escaped(each)}</div>" for each in notes)


def evidence_text(line: FindingLine) -> str:
    """Return the evidence of a finding, and why it cannot be corrected where it cannot."""
    finding = line.finding
    told = [finding.text[:1].upper() + finding.text[1:] + "."]
    if finding.fault is MapFault.MOVED:
        told += [f"Seen in {each.seen} of {each.expected} scans." for each in finding.evidence]
    if line.why_not:
        told.append(f"{line.why_not[:1].upper()}{line.why_not[1:]}.")
    return f"<div class='c-note' style='padding:0 10px 6px 30px'>{escaped(' '.join(told))}</div>"


def changes_text(ticked: tuple[MapFinding, ...]) -> str:
    """Return what the map says before and after the correction, a line for each reflector."""
    if not ticked:
        return ""
    lines = [("x, y [m]", "map now", "corrected")]
    lines += [(each.id, _place(each.before), _after(each)) for each in ticked]
    rows = "".join("<tr>" + "".join(f"<td>{escaped(cell)}</td>" for cell in line) + "</tr>" for line in lines)
    return f"<div style='padding:2px 10px 4px 6px'><table class='c-before-after'>{rows}</table></div>"


def _place(at: tuple[float, float] | None) -> str:
    return "not there" if at is None else f"{at[0]:.3f}, {at[1]:.3f}"


def _after(finding: MapFinding) -> str:
    return "gone" if finding.fault is MapFault.MISSING else _place(finding.after)
