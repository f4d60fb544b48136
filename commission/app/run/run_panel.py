"""What drives: a virtual vehicle or a recording, and what is done to it while it does."""

from __future__ import annotations

from dataclasses import replace

from viser import GuiApi

from commission.app.base import actions, theme
from commission.app.base.field_widget import Entry
from commission.app.base.inputs import enable, show, write_html
from commission.app.base.panel import BasePanel, Post, escaped, posting
from commission.app.base.reach import typed_path
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.run.actions import (
    ChooseSource,
    ColorTrail,
    Cover,
    Locate,
    RecordedDrive,
    Repeat,
    Restart,
    VirtualDrive,
)
from commission.app.run.hypotheses import hypotheses_html
from commission.app.run.state import RunState
from commission.app.run.trail_colors import TrailBy
from commission.app.run.view import RunView
from commission.site.quantity import PERCENT

NO_ROUTE = ("(the project has none)",)


class RunPanel(BasePanel):
    """Choice of the source."""

    def __init__(self, gui: GuiApi, post: Post, state: AppState) -> None:
        self._gui = gui
        self._now = gui.add_html("")
        self._progress = gui.add_progress_bar(0.0, visible=False, animated=True)
        self._shown = ""
        self._locate = gui.add_button(
            "Locate",
            hint="From the cursor on: throw the pose away. The vehicle looks where it is by the reflectors that it "
            "sees, without output until one place is left.",
            color="gray",
            visible=False,
        )
        self._locate.on_click(posting(post, lambda _event: Locate()))
        self._hypotheses = gui.add_html("", visible=False)
        self._add_drive(post, state)
        self._add_recording(post, state)
        with gui.add_folder("During the run"):
            self._cover = gui.add_checkbox(
                "Cover reflectors",
                False,
                hint="From here on no reflector is seen, as if someone had covered them all.",
            )
            self._cover.on_update(posting(post, lambda event: Cover(bool(event.target.value))))
            self._repeat = gui.add_checkbox(
                "Repeat at the end", state.part(RunState).repeat, hint="The drive starts again at its initial pose."
            )
            self._repeat.on_update(posting(post, lambda event: Repeat(bool(event.target.value))))
            self._trail = gui.add_dropdown(
                "Trail shows",
                tuple(TrailBy),
                initial_value=state.part(RunState).trail_by,
                hint="What the trail on the floor is colored by: how well the detections of the last second fit.",
            )
            self._trail.on_update(posting(post, lambda event: ColorTrail(TrailBy(event.target.value))))
            restart = gui.add_button(
                "Restart",
                hint="Back to the start: the whole drive with the setup of now, nothing covered on the way.",
                color="gray",
            )
            restart.on_click(posting(post, lambda _event: Restart()))

    def _add_drive(self, post: Post, state: AppState) -> None:
        names = _routes(state)
        source = state.part(RunState).source
        drive = source if isinstance(source, VirtualDrive) else None
        with self._gui.add_folder("Virtual drive"):
            self._route = self._gui.add_dropdown(
                "Route", names, initial_value=drive.route if drive else None, hint="The one that is driven."
            )
            first = drive or VirtualDrive("")
            if first.people is None:
                first = replace(first, people=state.project.disturbances.people)
            seed, people = (Entry(self._gui, name, first) for name in ("seed", "people"))
            self._drive = self._gui.add_button("Drive", hint="Simulate the drive and run it.")
        self._follow_routes(state)
        self._drive.on_click(
            posting(
                post,
                lambda _event: ChooseSource(VirtualDrive(self._route.value, seed.read(), people.read())),
            )
        )

    def _add_recording(self, post: Post, state: AppState) -> None:
        source = state.part(RunState).source
        shown = str(source.path) if isinstance(source, RecordedDrive) else ""
        with self._gui.add_folder("Recording"):
            self._gui.add_html(theme.path_mark("recording"))
            path = self._gui.add_text(
                "Folder", shown, hint="Path, on the computer that serves this page, of a recording."
            )
            start = self._gui.add_button("Open", hint="Read the recording and run it.")
        start.on_click(
            posting(
                post,
                lambda _event: (
                    ChooseSource(RecordedDrive(typed_path(path.value)))
                    if path.value.strip()
                    else actions.Report("no recording was named; expected the path of a folder")
                ),
            )
        )

    def _follow_routes(self, state: AppState) -> None:
        """Offer the routes that there are now."""
        names = _routes(state)
        if self._route.options != names:
            self._route.options = names
        why_not = "the project has no route; draw one with the tool Route" if names == NO_ROUTE else ""
        for widget in (self._route, self._drive):
            enable(widget, why_not)

    def draw_slowly(self, view: PageView) -> None:
        """Show what runs and what is being prepared."""
        self._follow_routes(view.state)
        content = _now(view)
        if content != self._shown:
            self._shown = content
            self._now.content = content
        jobs = view.jobs
        self._progress.visible = bool(jobs)
        if jobs:
            self._progress.value = PERCENT.of(min(max(jobs[0].fraction, 0.0), 1.0))
        run = view.part(RunView)
        # While a vehicle drives now, it is located beside its connection.
        show(self._locate, visible=run is not None and not view.state.part(RunState).live)
        write_html(self._hypotheses, hypotheses_html(run))
        if run is not None and self._cover.value is not run.covered:
            self._cover.value = run.covered
        if self._repeat.value is not view.state.part(RunState).repeat:
            self._repeat.value = view.state.part(RunState).repeat
        if self._trail.value != view.state.part(RunState).trail_by:
            self._trail.value = view.state.part(RunState).trail_by


def _routes(state: AppState) -> tuple[str, ...]:
    """Return what the list of routes offers."""
    return tuple(route.name for route in state.project.routes) or NO_ROUTE


def _now(view: PageView) -> str:
    """Say in one line what drives, and what is under way."""
    source = view.state.part(RunState).source
    if isinstance(source, VirtualDrive):
        what = f"Virtual drive, route <b>{escaped(source.route)}</b>, seed {source.seed}"
    elif isinstance(source, RecordedDrive):
        what = f"Recording <b>{escaped(source.path.name)}</b>"
    elif view.state.part(RunState).live:
        what = "Live vehicle"
    else:
        what = "Nothing drives yet: choose a virtual drive or a recording."
    under_way = [escaped(job.line) for job in view.jobs]
    note = f"<br><span class='c-note'>{'; '.join(under_way)}</span>" if under_way else ""
    return f"<div style='font-size:12.5px;padding:2px 4px'>{what}{note}</div>"
