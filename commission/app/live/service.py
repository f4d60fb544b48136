"""Brings live sources in step with what is asked: connects, localizes what they say, tells how they are doing."""

from __future__ import annotations

import time
from pathlib import Path

from commission.app.base.actions import Action, Sender
from commission.app.base.effects import Effect
from commission.app.base.growing import RunGrew
from commission.app.base.service import IDLE_S, Context, Due, Service
from commission.app.base.state import AppState
from commission.app.live.actions import Connect, Disconnect
from commission.app.live.effects import CloseRecording, CloseSources, LocateNow, OpenRecording, OpenSources
from commission.app.live.state import LiveState
from commission.app.live.view import LiveView, SourceView
from commission.errors import CommissionError
from commission.io.live.checklist import checklist, own_addresses
from commission.io.live.live_run import LiveRun
from commission.io.live.registry import SourceAddress
from commission.io.live.runner import LiveRunner, LiveSnapshot
from commission.io.live.session import Session
from commission.io.live.session_recorder import SessionRecorder, new_recording
from commission.io.vda5050_states import StateStream

FOLLOW_S = 0.1
"""Time after which a live run is looked at again [s]."""
FOLDER = "recordings"
"""Folder of recordings within the project's."""
READS = ("reflectors", "scanners", "parameters", "uncertainty")
"""Parts of the project that the localizer is set up with."""


class LiveService(Service):
    """The sources that are listened to, and the run that they feed.

    Parameters
    ----------
    context : what it is made with.
    """

    effects = (OpenSources, CloseSources, LocateNow, OpenRecording, CloseRecording)

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self._runner: LiveRunner | None = None
        # Not the run itself: what was left may be remembered for long.
        self._drive = object()
        # Written by the runner's thread, read by the owner's: the newest one wins.
        self._latest: LiveSnapshot | None = None
        self._shown: LiveSnapshot | None = None
        self._own: tuple[str, ...] = ()
        self._recorder: SessionRecorder | None = None
        self._states: StateStream | None = None

    def start(self) -> None:
        """Connect to what the page begins with."""
        asked = self.context.state.part(LiveState)
        if asked.sources:
            self.context.post(Connect(asked.sources, asked.start))

    def carry_out(self, effect: Effect, state: AppState, sender: Sender) -> None:
        """Connect, disconnect or record.

        Raises
        ------
        SourceError
            an address cannot be listened at.
        UsageError, FileFormatError
            a recording cannot be made there.
        """
        if isinstance(effect, OpenRecording):
            self._record(effect.path, state, sender)
            return
        if isinstance(effect, LocateNow):
            if self._runner is not None:
                self._runner.locate()
            return
        if isinstance(effect, CloseRecording):
            self._stop_recording()
            return
        self._end()
        if isinstance(effect, OpenSources):
            try:
                self._open(effect, state)
            except CommissionError:
                self._latest = self._shown = None
                self.context.post(Disconnect())
                raise

    def _open(self, effect: OpenSources, state: AppState) -> None:
        names = tuple(scanner.name for scanner in state.project.scanners)
        session = Session.of([SourceAddress.parse(text) for text in effect.sources], names)
        wanted = state.part(LiveState).states
        if wanted is not None and self._states is None:
            # One file for all connections: numbers of messages go on.
            self._states = StateStream(wanted, state.project.name)
        run = LiveRun(state.project, effect.start)
        self._drive = object()
        runner = LiveRunner(session, run, self._publish, states=self._states)
        runner.start()
        self._own = own_addresses()
        self._runner = runner

    def _end(self) -> None:
        """Stop listening; the run so far is shown as any other."""
        runner, self._runner = self._runner, None
        if runner is None:
            return
        self._latest = last = runner.stop()
        if self._recorder is not None:
            self._recorder.close()
        self._grow(last, is_over=True)

    def _record(self, path: Path | None, state: AppState, sender: Sender) -> None:
        """Begin a recording; the one before ends."""
        runner = self._runner
        if runner is None:
            return
        if path is not None:
            path = state.reach.checked(path, sender)
        elif state.folder is not None:
            path = new_recording(state.folder / FOLDER, time.strftime("%Y%m%d-%H%M%S"))
        else:
            return
        recorder = SessionRecorder(path, state.project.scanners)
        self._stop_recording()
        self._recorder = recorder
        runner.record_to(recorder)

    def _stop_recording(self) -> None:
        """End the recording that is made; what it was stays shown."""
        if self._runner is not None:
            self._runner.record_to(None)
        if self._recorder is not None:
            self._recorder.close()

    def _publish(self, snapshot: LiveSnapshot) -> None:
        self._latest = snapshot

    def project_changed(self, action: Action, before: AppState, after: AppState) -> None:  # noqa: ARG002 - the service's
        """Localize with what is different from the next record on."""
        if self._runner is not None and any(
            getattr(before.project, part) is not getattr(after.project, part) for part in READS
        ):
            self._runner.use(after.project)

    def follow(self, state: AppState) -> Due:  # noqa: ARG002 - the service's
        """Hand the newest run on."""
        latest = self._latest
        if latest is None or latest is self._shown:
            return Due.NEVER
        self._shown = latest
        if self._runner is not None:
            self._grow(latest, is_over=False)
        return Due.SOON

    def _grow(self, snapshot: LiveSnapshot, *, is_over: bool) -> None:
        """Tell of the run so far, where there is one."""
        run = snapshot.run
        if run.result is not None and run.belief is not None:
            self.context.post(
                RunGrew(result=run.result, belief=run.belief, mode=run.mode, is_over=is_over, of=self._drive)
            )

    def rest(self, state: AppState) -> float:  # noqa: ARG002 - the service's
        """Return the time until something is due again [s]."""
        return IDLE_S if self._runner is None else FOLLOW_S

    def parts(self, *, slowly: bool) -> tuple[object, ...]:  # noqa: ARG002 - the service's
        """Return how the sources are doing."""
        shown = self._shown
        if shown is None:
            return ()
        sources = tuple(
            SourceView(each.address, each.status, checklist(each.address, each.status, self._own), each.too_late)
            for each in shown.sources
        )
        told = tuple(f"{count} {words}" for words, count in shown.told.items())
        if shown.run.forgotten_s:
            gone = f"the first {shown.run.forgotten_s / 3600.0:.1f} h are not on the page any more"
            told = (*told, f"{gone}, which keeps the newest hour or two; a recording that is made holds all")
        recording = None if self._recorder is None else self._recorder.status()
        return (LiveView(sources=sources, told=told, recording=recording, account=shown.account, clocks=shown.clocks),)

    def close(self) -> None:
        """Stop listening."""
        runner, self._runner = self._runner, None
        if runner is not None:
            runner.stop()
        if self._recorder is not None:
            self._recorder.close()
        if self._states is not None:
            self._states.close()
