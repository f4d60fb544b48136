"""Brings the run in step with what is asked of it: loads what drives, localizes it whole, moves the cursor over it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from commission import compiled
from commission.app.base.actions import Action, Envelope, Report, Sender
from commission.app.base.drive_now import DriveNow
from commission.app.base.effects import Effect
from commission.app.base.growing import RunGrew
from commission.app.base.jobs import Job, Lane
from commission.app.base.service import IDLE_S, Context, Due, Service
from commission.app.base.shown_run import LearnedFromDrive, RunShown
from commission.app.base.state import AppState
from commission.app.base.view import Followed, LivedPath
from commission.app.run import drives
from commission.app.run.actions import ChooseSource, Play, RecordedDrive, ShowLive, Source, SourceLoaded
from commission.app.run.camera_tracks import CameraTracks
from commission.app.run.drives import Drive
from commission.app.run.effects import (
    CoverFromHere,
    DriveAgain,
    LoadSource,
    LocateFromHere,
    MakeCurves,
    MoveByScans,
    MoveTo,
    PlayOn,
    RunAfresh,
    ShowGrown,
)
from commission.app.run.instruments import Instruments
from commission.app.run.playback import Playback
from commission.app.run.state import RunState
from commission.app.run.variant_actions import DropRun, KeepRun
from commission.app.run.variant_runs import VariantRuns
from commission.app.run.view import DrivenHall, RunView
from commission.app.run.world import World
from commission.geometry import rasterize, se2, spline_kernels
from commission.localization.detection_log import cycle_stamps
from commission.localization.setup import LocalizerSetup
from commission.progress import Progress
from commission.simulation import follower, scan
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.studies import curves, run
from commission.studies.run import RunInput, RunResult, judged_run

PREPARE, COMPILE, LOCALIZE = "Preparing the drive", "Getting ready", "Localizing"
DRIVE_AGAIN = "Driving again in the changed hall"
PLAYING_REST_S = 0.04
LONGEST_STEP_S = 0.25
"""Time that the play clock moves at most at once [s]: a long pause of the owner thread is not made up for."""
READS = ("reflectors", "scanners", "parameters", "uncertainty", "floor_map")
"""Parts of the project that the localizer is set up with."""

Prepare: TypeAlias = Callable[[Project, Source, Progress], Drive]


def compile_kernels(progress: Progress) -> None:
    """Compile the kernels that a run needs, the first needed first; those of planning wait for their own jobs."""
    steps = (
        ("poses", se2.warm_up),
        ("curves", spline_kernels.warm_up),
        ("virtual vehicle", follower.warm_up),
        ("virtual scanner", scan.warm_up),
        ("localizer", run.warm_up),
        ("drawing", rasterize.warm_up),
        ("plots", curves.warm_up),
    )
    compiled.warm_up(steps, progress)


class RunService(Service):
    """The drive that is there, localized whole, and the cursor over it.

    Parameters
    ----------
    context : what it is made with.
    prepare : from a source to a drive; others only in tests.
    compile_all : compiles all kernels that a run needs.
    """

    effects = (
        LoadSource,
        MoveTo,
        MoveByScans,
        PlayOn,
        CoverFromHere,
        LocateFromHere,
        RunAfresh,
        DriveAgain,
        MakeCurves,
        ShowGrown,
        KeepRun,
        DropRun,
    )

    def __init__(
        self,
        context: Context,
        prepare: Prepare = drives.prepare,
        compile_all: Callable[[Progress], None] = compile_kernels,
    ) -> None:
        super().__init__(context)
        self.playback: Playback | None = None
        self._prepare, self._compile = prepare, compile_all
        self._jobs = context.jobs
        self._instruments = Instruments(context)
        self._camera = CameraTracks(context)
        self._variants = VariantRuns(context)
        self._followed_at = context.clock()
        self._project = context.state.project
        self._wanted: RunInput | None = None
        self._source: Source | None = None
        # What was true in the drive that is there, and in the one that is being simulated in its place.
        self._world: World | None = None
        # What the project says of that world since it has learned from the drive: it is the same hall.
        self._told: tuple[World, ...] = ()
        self._coming: World | None = None
        self._again: RecordLog | None = None
        # The live run that is on the page, and the start of the one that something else was chosen instead of.
        self._live: RunGrew | None = None
        self._left: object = None

    def start(self) -> None:
        """Compile, and load what the page begins with."""
        self._jobs.start(COMPILE, self._compile)
        source = self.context.state.part(RunState).source
        if source is not None:
            self.context.post(ChooseSource(source))

    def project_changed(self, action: Action, before: AppState, after: AppState) -> None:
        """Run again with what is different: from the start, or from here on where that is asked for."""
        self._project = after.project
        if isinstance(action, LearnedFromDrive) and self._is_driven(World.of(before.project, self._source)):
            told = World.of(after.project, self._source)
            self._told = (*self._told, *(() if told is None else (told,)))
        if self._wanted is None or self._live is not None or self._drives_again(after):
            # A live run goes on with the change: its localizer is told by who feeds it.
            return
        is_same = all(getattr(before.project, part) is getattr(after.project, part) for part in READS)
        first = self._cursor() if after.part(RunState).from_here_on else 0
        if not is_same and (first == 0 or not self._is_over(first)):
            self._localize(self._wanted.with_setup(LocalizerSetup.of(after.project), first))

    def carry_out(self, effect: Effect, state: AppState, sender: Sender) -> None:
        """Load a drive, or move over the one that is there."""
        playback = self.playback
        match effect:
            case LoadSource(source):
                self._load(source, state, sender)
            case ShowGrown(grown):
                self._show_grown(grown)
            case MoveTo(seconds) if playback is not None:
                playback.seek(seconds)
            case MoveByScans(scans) if playback is not None:
                playback.step(scans)
            case CoverFromHere() | LocateFromHere() | RunAfresh() if self._live is not None:
                told = Report("the vehicle drives now: what is past stays as it was", failed=False)
                self.context.post(Envelope(told, sender))
            case CoverFromHere() | LocateFromHere():
                self._act_from_here(effect, sender)
            case PlayOn(backward) if playback is not None:
                if playback.at_start if backward else playback.at_end:
                    playback.seek(playback.result.duration if backward else 0.0)
            case MakeCurves(window) if playback is not None:
                self._instruments.save(playback.result, window, sender)
            case RunAfresh() if playback is not None and self._wanted is not None:
                playback.seek(0.0)
                self._localize(RunInput.of(state.project, self._wanted.log, self._wanted.start))
            case DriveAgain() if self._wanted is not None:
                self._drives_again(state)
            case _:
                self._variants.carry_out(effect, self._wanted, state)

    def _drives_again(self, state: AppState) -> bool:
        """Simulate a virtual drive again where its world is another one now; return whether that is under way."""
        asked = state.part(RunState)
        keeps = asked.only_the_map or asked.from_here_on
        world = None if keeps else World.of(state.project, self._source)
        if world is None or self._is_driven(world):
            if self._coming is not None:
                # What was changed and is as before: the localizer has not followed in between.
                self._jobs.cancel(DRIVE_AGAIN)
                self._coming = None
                if self._wanted is not None:
                    self._localize(self._wanted.with_setup(LocalizerSetup.of(state.project)))
            return False
        if world != self._coming:
            self._coming = world
            project, source, prepare = state.project, world.drive, self._prepare
            self._jobs.start(
                DRIVE_AGAIN,
                lambda progress: prepare(project, source, progress),
                then=self._begin_again,
                failed=self._stay,
                stopped=self._stay,
                lane=Lane.RUN,
            )
        return True

    def _is_driven(self, world: World | None) -> bool:
        """Whether a world is that of the drive on the page, as it was made or by what was learned from it."""
        return world is not None and (world == self._world or world in self._told)

    def _begin_again(self, drive: Drive) -> None:
        """Localize the drive that was simulated in place of the one that is there; what was covered is, again."""
        self._world, self._told, self._coming, self._again = self._coming, (), None, drive.log
        wanted, before = RunInput.of(self._project, drive.log, drive.start), self._wanted
        stamps = cycle_stamps(drive.log)
        for segment in () if before is None else before.segments:
            began_ns = cycle_stamps(before.log)[segment.first] if before is not None and segment.first else 0
            first = int(np.searchsorted(stamps, began_ns))
            if first < len(stamps):
                wanted = wanted.with_cover(first, covered=segment.covered)
                wanted = wanted.with_locate(first) if segment.locate else wanted
        self._localize(wanted)

    def _stay(self, job: Job | None = None) -> Action | None:
        """Stay with the drive that is there, since another one cannot be driven or was stopped; say why."""
        self._coming = None
        return None if job is None else Report(f"{job.name}: {job.error}; the drive shown is that of before")

    def _cursor(self) -> int:
        """Return the number of cycles up to the cursor; none while the drive that is wanted is not on the page yet."""
        return self.playback.lived if self.playback is not None and self._is_on_page() else 0

    def _is_on_page(self) -> bool:
        """Whether the page shows the drive that is wanted."""
        return (
            self._wanted is not None
            and self.playback is not None
            and self._wanted.log is self.playback.result.inputs.log
        )

    def _is_over(self, cycle: int) -> bool:
        """Whether no cycle is left to act on."""
        return self.playback is not None and self._is_on_page() and cycle >= self.playback.result.cycles

    def _load(self, source: Source, state: AppState, sender: Sender) -> None:
        """Prepare a drive; why it cannot be is told to who asked."""
        if isinstance(source, RecordedDrive):
            source = RecordedDrive(state.reach.checked(source.path, sender))
        project, prepare, world = state.project, self._prepare, World.of(state.project, source)
        self._jobs.start(
            PREPARE,
            lambda progress: prepare(project, source, progress),
            then=lambda drive: self._begin(drive, source, world),
            failed=lambda job: Envelope(Report(f"{job.name}: {job.error}", listed=f"{job.name} failed"), sender),
        )

    def _act_from_here(self, effect: CoverFromHere | LocateFromHere, sender: Sender) -> None:
        """Cover or uncover the reflectors, or throw the pose away, from the cursor on."""
        first = self._cursor()
        if self._wanted is None:
            return
        if self._is_over(first):
            told = Report("the drive is over; nothing happens behind its end: go back first", failed=False)
            self.context.post(Envelope(told, sender))
            return
        if isinstance(effect, CoverFromHere):
            self._localize(self._wanted.with_cover(first, covered=effect.covered))
        else:
            self._localize(self._wanted.with_locate(first))

    def _show_grown(self, grown: RunGrew) -> None:
        """Show a live run as far as it has come; one that is over is a run as any other."""
        if grown.which is self._left:
            return
        playback, live = self.playback, self._live
        # A long one goes on from a later start than that which is shown.
        known = live.result if live is not None and live.which is grown.which else grown.result
        if playback is None or playback.result.inputs.start is not known.inputs.start:
            self._jobs.cancel(DRIVE_AGAIN)
            self._jobs.cancel(LOCALIZE)
            self._source = self._world = self._coming = None
            self._told = ()
            self.playback = playback = Playback(grown.result)
            self._camera.take(grown.result, None)
            playback.seek(grown.result.duration)
            self.context.post(ShowLive())
            self.context.post(RunShown(None))
        else:
            playback.grow(grown.result)
        self._wanted, self._live = grown.result.inputs, None if grown.is_over else grown
        if grown.is_over:
            self._instruments.take(grown.result, self._project.floor_map)
            self._variants.take(grown.result)
            self.context.post(RunShown(grown.result))

    def _begin(self, drive: Drive, source: Source, world: World | None) -> Action:
        """Localize a new drive; the run before stays on the page until that is done."""
        self._jobs.cancel(DRIVE_AGAIN)
        if self._live is not None:
            self._left, self._live = self._live.which, None
        self._source, self._world, self._told, self._coming = source, world, (), None
        self._localize(RunInput.of(self._project, drive.log, drive.start))
        return SourceLoaded(source)

    def _localize(self, wanted: RunInput) -> None:
        """Localize the whole drive in the background, unless that is what is there, or under way."""
        if wanted == self._wanted:
            return
        self._wanted = wanted
        earlier = None if self.playback is None else self.playback.result
        self._jobs.start(
            LOCALIZE,
            lambda progress: judged_run(wanted, progress, earlier=earlier),
            then=self._take,
            failed=self._give_up,
            stopped=self._give_up,
            lane=Lane.RUN,
        )

    def _give_up(self, job: Job | None = None) -> Action | None:
        """Go on with the run that is there, since another one failed or was stopped; say why."""
        self._wanted = None if self.playback is None else self.playback.result.inputs
        return None if job is None else Report(f"{job.name}: {job.error}")

    def _take(self, result: RunResult) -> Action | None:
        """Show a run: over the same drive, or one in its place, where the cursor is; a new one plays from its start."""
        playback = self.playback
        self._instruments.take(result, self._project.floor_map)
        self._camera.take(result, self._source)
        self._variants.take(result)
        self.context.post(RunShown(result))
        if playback is not None and playback.result.inputs.log is result.inputs.log:
            playback.replace(result)
            return None
        self.playback = Playback(result)
        if playback is not None and result.inputs.log is self._again:
            self.playback.seek(playback.time)
            return None
        return Play(playing=True)

    def follow(self, state: AppState) -> Due:
        """Move the cursor by the time that has passed, and see to the end of the drive."""
        now = self.context.clock()
        elapsed, self._followed_at = now - self._followed_at, now
        playback, asked = self.playback, state.part(RunState)
        if playback is None or not asked.playing:
            return Due.NEVER
        before = playback.lived
        direction = -1.0 if asked.backward else 1.0
        playback.advance(min(elapsed, LONGEST_STEP_S) * asked.speed * direction)
        if playback.at_start if asked.backward else playback.at_end:
            if asked.repeat:
                playback.seek(playback.result.duration if asked.backward else 0.0)
            else:
                self.context.post(Play(playing=False))
        return Due.SOON if playback.lived != before else Due.SLOWLY

    def rest(self, state: AppState) -> float:
        """Return the time until something is due again [s]."""
        return PLAYING_REST_S if self.playback is not None and state.part(RunState).playing else IDLE_S

    def view(self, *, whole: bool = True) -> RunView | None:
        """Return the run as it is now, `whole` with every detection so far; none before there is one."""
        if self.playback is None or self._wanted is None:
            return None
        view = self.playback.view(covered=self._wanted.segment(self._cursor()).covered, whole=whole)
        if self._live is not None and self.playback.at_end:
            # Since the newest scan the vehicle has moved on, or nothing was heard of it.
            belief = self._live.belief
            view = replace(view, pose=belief.mean, covariance=belief.covariance, mode=self._live.mode)
        return replace(view, hall=self._hall(), kept=self._variants.kept_over(view.result))

    def _hall(self) -> DrivenHall:
        """Whether the drive is one in the hall, and with the vehicle, of the project."""
        if self._coming is not None:
            return DrivenHall.DRIVING_AGAIN
        if self._world is None:
            return DrivenHall.RECORDED
        return DrivenHall.AS_DRIVEN if self._is_driven(World.of(self._project, self._source)) else DrivenHall.OTHER

    def parts(self, *, slowly: bool) -> tuple[object, ...]:
        """Return the run as it is now, the place that cameras follow, what is driven so far, and its records."""
        view = self.view(whole=slowly)
        if view is None:
            return ()
        result, here = view.result, slice(view.lived)
        lived = LivedPath(result.columns.means[here], result.two_sigma[here], result.position_two_sigma[here])
        drive = DriveNow(result.inputs, result.inputs.log.first_ns + round(view.time * 1e9), result.columns)
        found = self._instruments.found, self._variants.compared_over(result), self._camera.found
        some = (each for each in found if each is not None)
        return view, Followed((float(view.pose[0]), float(view.pose[1]))), lived, drive, *some
