"""The step Plan, third part: what fails with one reflector, and which reflectors matter most."""

from __future__ import annotations

from typing import Any

from viser import GuiApi, GuiDropdownHandle

from commission.app.base.actions import Action
from commission.app.base.inputs import Inputs, Setting, Text, WorkBar, show
from commission.app.base.numbers import metres_text
from commission.app.base.panel import BasePanel, Post, escaped, posting, table
from commission.app.base.view import PageView
from commission.app.failures.actions import AlsoFails, ChooseFailure, DropRanking, RankReflectors, ShowFailure
from commission.app.failures.service import RANKING
from commission.app.failures.settings import FailureSettings
from commission.app.failures.view import FailureView
from commission.planning.dependence import Failure
from commission.site.fields import get_field
from commission.site.quantity import PERCENT

FAILURE_NAMES: dict[Failure, str] = {
    Failure.BLOCKED: "blocked",
    Failure.DIRTY: "dirty",
    Failure.MOVED: "moved by 5 cm",
}
NO_REFLECTOR = "none"
RANKED_SHOWN = 10


class FailurePanel(BasePanel):
    """Widgets of the ranking."""

    def __init__(self, gui: GuiApi, post: Post) -> None:
        self._inputs = Inputs(gui, post, _asked, lambda state, name: get_field(state.part(FailureSettings), name))
        self._inputs.choice("failure", FailureSettings(), FAILURE_NAMES)
        rank = gui.add_button("Rank reflectors", hint="Let each fail on every route, and rank what depends on it.")
        rank.on_click(posting(post, lambda _event: RankReflectors()))
        hint = "Let the one that is shown, else the first of the list, fail for good, and rank the others."
        self._next = gui.add_button("Next failure after it", color="gray", visible=False, hint=hint)
        self._next.on_click(posting(post, self._failing_next))
        self._work = WorkBar(gui, post, RANKING, DropRanking())
        self._failed: GuiDropdownHandle[Any] = gui.add_dropdown(
            "Show", (NO_REFLECTOR,), visible=False, hint="Reflector whose failing metres are drawn; or click on it."
        )
        self._inputs.connect(
            "failed",
            self._failed,
            lambda name: "" if name == NO_REFLECTOR else name,
            lambda state: (
                state.part(FailureSettings).failed
                if state.part(FailureSettings).failed in self._failed.options
                else NO_REFLECTOR
            ),
        )
        self._table = Text(gui)
        self._failures: FailureView | None = None

    def _failing_next(self, _event: Any) -> Action:
        """Let one fail of the ranking that is seen; it may have been dropped since it was drawn."""
        failures = self._failures
        if failures is None or not failures.names:
            return RankReflectors()
        return AlsoFails(failures.failed if failures.chosen is not None else failures.names[0])

    def draw_slowly(self, view: PageView) -> None:
        """Follow settings, progress and result."""
        failures = self._failures = view.part(FailureView)
        options = (NO_REFLECTOR, *(() if failures is None else failures.names))
        if self._failed.options != options:
            self._failed.options = options
        show(self._failed, visible=len(options) > 1)
        self._inputs.follow(view.state)
        is_running = self._work.follow(view)
        show(self._next, visible=len(options) > 1 and not is_running)
        self._table.write((failures,), lambda: "" if failures is None else ranking_table(failures))


def _asked(name: str, value: Setting) -> Action:
    """The action of an input."""
    return ChooseFailure(str(value)) if name == "failure" else ShowFailure(str(value))


def ranking_table(failures: FailureView) -> str:
    """The reflectors on which most depends, and what fails with the chosen one."""
    rows = [("<b>Without</b>", "<b>fails</b>; 2σ / limit")]
    if failures.fallen:
        rows.insert(0, ("Failed before", ", ".join(escaped(name) for name in failures.fallen)))
    rows += [
        (escaped(name), f"{each.failing_metres} m; {PERCENT.text(each.limit_share)}")
        for name, each in list(zip(failures.names, failures.ranking, strict=True))[:RANKED_SHOWN]
    ]
    chosen = failures.chosen
    note = "<div class='c-note'>The site has changed since: rank again.</div>" if failures.outdated else ""
    if chosen is not None:
        parts = [f"{escaped(part.route)}: {metres_text(part.metres.tolist())}" for part in chosen.routes]
        note += "<div class='c-note' style='padding-top:4px'>" + "<br>".join(parts) + "</div>"
    elif failures.failed:
        seen = "has failed before" if failures.failed in failures.fallen else "is seen on no route"
        note += f"<div class='c-note' style='padding-top:4px'>{escaped(failures.failed)} {seen}.</div>"
    if not any(each.failing_metres for each in failures.ranking):
        note += "<div class='c-note' style='padding-top:4px'>No metre of any route fails with any single one.</div>"
    return f"<div class='c-ranking' style='padding:2px 10px 6px 6px'>{table(rows)}{note}</div>"
