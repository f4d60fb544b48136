"""Brings the run in step with what is asked of it: loads what drives, feeds the localizer, looks ahead."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from commission import compiled
from commission.app.base.actions import Action, Envelope, Report, Sender
from commission.app.base.effects import Effect
from commission.app.base.service import IDLE_S, Context, Due, Service
from commission.app.base.state import AppState
from commission.app.base.view import Followed
from commission.app.run import drives
from commission.app.run.actions import ChooseSource, Play, Recording, Source
from commission.app.run.effects import LoadSource, MoveTo, ProcessOneScan
from commission.app.run.history import episodes
from commission.app.run.session import Drive, Session
from commission.app.run.state import RunState
from commission.geometry import rasterize, se2, spline_kernels
from commission.localization import localizer, whole_run
from commission.localization.estimate import Mode
from commission.localization.setup import LocalizerSetup
from commission.progress import Progress
from commission.simulation import follower, scan
from commission.site.project import Project

PREPARE, COMPILE, PREDICT = "Preparing the drive", "Getting ready", "Predicting the rest"
PLAYING_REST_S, SEEKING_REST_S = 0.04, 0.001
LONGEST_STEP_S = 0.25
"""Time that the play clock moves at most at once [s]: a long pause of the owner thread is not made up for."""
READS = ("reflectors", "scanner", "vehicle", "parameters")
"""Parts of the project that the localizer is set up with."""

Episodes: TypeAlias = tuple[tuple[float, float], ...]
Prepare: TypeAlias = Callable[[Project, Source, Progress], Drive]
Predict: TypeAlias = Callable[[Drive, LocalizerSetup], Episodes]


def predicted_episodes(drive: Drive, setup: LocalizerSetup) -> Episodes:
    """Fail episodes [s] of the whole drive with these parameters."""
    run = whole_run.run(drive.log, setup, drive.initial)
    times = (run.stamps_ns - drive.log.stamps_ns[0]) * 1e-9
    return episodes(times, np.asarray(run.modes) == Mode.FAIL)


def compile_kernels(progress: Progress) -> None:
    """Compile the kernels that a run needs, the first needed first; those of planning wait for their own jobs."""
    steps = (
        ("poses", se2.warm_up),
        ("curves", spline_kernels.warm_up),
        ("virtual vehicle", follower.warm_up),
        ("virtual scanner", scan.warm_up),
        ("localizer", localizer.warm_up),
        ("prediction", whole_run.warm_up),
        ("drawing", rasterize.warm_up),
    )
    compiled.warm_up(steps, progress)


class RunService(Service):
    """The drive that is there, and the localizer that runs over it.

    Parameters
    ----------
    context : what it is made with.
    prepare : from a source to a drive; others only in tests.
    predict : fail episodes of a whole run.
    compile_all : compiles all kernels that a run needs.
    """

    effects = (LoadSource, MoveTo, ProcessOneScan)

    def __init__(
        self,
        context: Context,
        prepare: Prepare = drives.prepare,
        predict: Predict = predicted_episodes,
        compile_all: Callable[[Progress], None] = compile_kernels,
    ) -> None:
        super().__init__(context)
        self.session: Session | None = None
        self._prepare, self._predict_episodes, self._compile = prepare, predict, compile_all
        self._jobs = context.jobs
        self._followed_at = context.clock()
        self._setup_project = context.state.project

    def start(self) -> None:
        """Compile, and load what the page begins with."""
        self._jobs.start(COMPILE, self._compile)
        source = self.context.state.part(RunState).source
        if source is not None:
            self.context.post(ChooseSource(source))

    def project_changed(self, action: Action, before: AppState, after: AppState) -> None:  # noqa: ARG002 - the service's
        """Let the localizer go on with what is different."""
        self._setup_project = after.project
        is_same = all(getattr(before.project, part) is getattr(after.project, part) for part in READS)
        if self.session is not None and not is_same:
            self.session.set_setup(LocalizerSetup.of(after.project))
            self._predict()

    def carry_out(self, effect: Effect, state: AppState, sender: Sender) -> None:
        """Load a drive, or move over the one that is there."""
        session = self.session
        if session is not None:
            session.covered = state.part(RunState).covered
        match effect:
            case LoadSource(source):
                self._load(source, state, sender)
            case MoveTo(seconds, afresh) if session is not None:
                session.seek(seconds, afresh=afresh)
            case ProcessOneScan() if session is not None:
                session.step()
            case _:
                pass

    def _load(self, source: Source, state: AppState, sender: Sender) -> None:
        """Prepare a drive; why it cannot be is told to who asked."""
        if isinstance(source, Recording):
            source = Recording(state.reach.checked(source.path, sender))
        project, prepare = state.project, self._prepare
        self._jobs.start(
            PREPARE,
            lambda progress: prepare(project, source, progress),
            then=self._begin,
            failed=lambda job: Envelope(Report(f"{job.name}: {job.error}", listed=f"{job.name} failed"), sender),
        )

    def _begin(self, drive: Drive) -> Action:
        """Run the localizer over a new drive, playing."""
        self.session = Session(drive, LocalizerSetup.of(self._setup_project))
        self._predict()
        return Play(playing=True)

    def _predict(self) -> None:
        """Look ahead in the background: where the supervisor will stop the vehicle with these parameters."""
        session = self.session
        if session is None:
            return
        drive, setup, predict = session.drive, session.setup, self._predict_episodes

        def work(progress: Progress) -> Episodes:
            progress(0.0, "")
            return predict(drive, setup)

        def take(found: Episodes) -> None:
            session.predicted = found

        self._jobs.start(PREDICT, work, then=take, is_shown=False)

    def follow(self, state: AppState) -> Due:
        """Process the records that are due, and see to the end of the drive."""
        now = self.context.clock()
        elapsed, self._followed_at = now - self._followed_at, now
        session, asked = self.session, state.part(RunState)
        if session is None:
            return Due.NEVER
        session.covered = asked.covered
        if not asked.playing and session.seeking is None:
            return Due.NEVER
        cycles = session.advance(min(elapsed, LONGEST_STEP_S) * asked.speed)
        if session.at_end and session.seeking is None and asked.playing:
            if asked.repeat:
                session.seek(0.0, afresh=True)
            else:
                self.context.post(Play(playing=False))
        return Due.SOON if cycles else Due.SLOWLY

    def rest(self, state: AppState) -> float:
        """Return the time until something is due again [s]."""
        if self.session is None:
            return IDLE_S
        if self.session.seeking is not None:
            return SEEKING_REST_S
        return PLAYING_REST_S if state.part(RunState).playing else IDLE_S

    def parts(self, *, slowly: bool) -> tuple[object, ...]:
        """Return the run as it is now, and the place that cameras follow."""
        if self.session is None:
            return ()
        run = self.session.view(whole=slowly)
        return run, Followed((float(run.pose[0]), float(run.pose[1])))
