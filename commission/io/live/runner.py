"""A session and a live run at work: one thread localizes what arrives, one tells how it goes."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from commission.errors import SourceError
from commission.io.live.accounts import RecordAccount
from commission.io.live.live_run import LiveResult, LiveRun
from commission.io.live.registry import SourceAddress
from commission.io.live.session import Session
from commission.io.live.session_recorder import SessionRecorder
from commission.io.live.status import SourceStatus
from commission.io.vda5050_states import StateStream
from commission.site.project import Project
from commission.site.records import Record
from commission.studies.arrival import ArrivalOffset
from commission.studies.run import RunResult

log = logging.getLogger(__name__)

TELL_S = 0.1
"""Time from one snapshot to the next [s]."""
TELLING_SHARE = 0.1
"""Share of its time that judging the run may take: of hours, figures come less often, how sources do as ever."""
CLOCKS_S = 2.0
"""Time from one look at what arrival says of the clocks to the next [s]."""
WAIT_S = 0.1
STUCK_S = 5.0
"""Time in which at the end one record at least has to be localized, or the rest is given up [s]."""


@dataclass(frozen=True, slots=True)
class SourceNow:
    """A source and how it is doing."""

    address: SourceAddress
    """Which one."""
    status: SourceStatus
    """As it is now."""
    too_late: Mapping[type[Record], int]
    """Its records that came too late and are left out, by kind."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LiveSnapshot:
    """All that is known of a live run at a moment."""

    sources: tuple[SourceNow, ...]
    """Its sources."""
    run: LiveResult
    """The run so far."""
    told: dict[str, int]
    """What was mended, and how often."""
    account: RecordAccount
    """What became of the records."""
    clocks: tuple[ArrivalOffset, ...] = ()
    """What arrival says of the scanners' clocks."""


class LiveRunner:
    """Localizes what a session delivers.

    Parameters
    ----------
    session : not started.
    run : not begun.
    publish : takes a snapshot some times in a second, from a thread of its own.
    keep : takes each record in its order, for a recorder.
    states : takes the messages of the vehicle's state; closing it is the caller's.
    """

    def __init__(
        self,
        session: Session,
        run: LiveRun,
        publish: Callable[[LiveSnapshot], None],
        keep: Callable[[Record], None] | None = None,
        states: StateStream | None = None,
    ) -> None:
        self.session, self.run = session, run
        self._publish, self._keep = publish, keep
        self._recorder: SessionRecorder | None = None
        self._states = states
        self._stopped = threading.Event()
        self._is_abandoned = threading.Event()
        self._taken = self._refused = 0
        self._clocks: tuple[ArrivalOffset, ...] = ()
        self._threads = [
            threading.Thread(target=self._localize, name="live localizer", daemon=True),
            threading.Thread(target=self._tell, name="live figures", daemon=True),
        ]

    def start(self) -> None:
        """Begin; raises SourceError where a source cannot be listened at."""
        self.session.start()
        for thread in self._threads:
            thread.start()

    def stop(self) -> LiveSnapshot:
        """End: what has arrived is localized, and the last snapshot returned.

        What is not localized since the localizer gets nowhere (a kernel is being compiled) is given up, and told.
        """
        self.session.stop()
        self._stopped.set()
        for thread in self._threads:
            if thread.ident is not None:
                self._wait_for(thread)
                if thread.is_alive():
                    self._is_abandoned.set()
        return self.snapshot()

    def _wait_for(self, thread: threading.Thread) -> None:
        """Wait until a thread has ended, on a busy computer for long, but not for one that gets nowhere."""
        done = -1
        while thread.is_alive() and done != self._taken:
            done = self._taken
            thread.join(timeout=STUCK_S)

    def record_to(self, recorder: SessionRecorder | None) -> None:
        """Record what comes from now on; None: no longer. Closing the file is the caller's."""
        self._recorder = recorder

    def use(self, project: Project) -> None:
        """Localize with another project from the next record on."""
        self.run.use(project)

    def locate(self) -> None:
        """Throw the pose away: from the next scan on the vehicle looks where it is."""
        self.run.locate()

    def snapshot(self, judged: RunResult | None = None) -> LiveSnapshot:
        """Return how it goes now; the run is that of before where there is one, else judged anew."""
        sorter = self.session.sorter
        told, late = Counter[str](sorter.told), Counter[tuple[int, type[Record]]](sorter.too_late)
        sources = tuple(
            SourceNow(source.address, source.status(), {kind: n for (of, kind), n in late.items() if of == number})
            for number, source in enumerate(self.session.sources)
        )
        kinds = Counter[type[Record]]()
        for (_, kind), count in late.items():
            kinds[kind] += count
        statuses, is_given_up = [each.status for each in sources], self._is_abandoned.is_set()
        account = RecordAccount.of(statuses, self._taken, kinds, self._refused, is_given_up=is_given_up)
        now_ns = None if self._stopped.is_set() else self.session.clock.now_ns()
        mended = {words: count for words, count in told.items() if count}
        run = self.run.so_far(now_ns, judged=judged)
        return LiveSnapshot(sources=sources, run=run, told=mended, account=account, clocks=self._clocks)

    def _localize(self) -> None:
        self.run.prepare()
        while not self._stopped.is_set():
            for record, _ in self.session.records(WAIT_S):
                self._take(record)
        for record in self.session.rest():
            if self._is_abandoned.is_set():
                # Whoever stopped it has closed the files that it would go on to write.
                return
            self._take(record)
        last = self.run.end()
        if self._states is not None:
            self._states.append(last, self.run.supervisor)
        if self._recorder is not None:
            self._recorder.append_estimates(last)

    def _take(self, record: Record) -> None:
        """Localize a record; one that cannot be is told to the log, and the next one is taken."""
        try:
            recorder = self._recorder
            is_first = recorder is not None and not recorder.is_begun
            belief = self.run.belief_before(record) if is_first else None
            sought = is_first and self.run.is_sought
            estimates = self.run.take(record)
            self._taken += 1
            if self._states is not None:
                self._states.append(estimates, self.run.supervisor)
            if self._keep is not None:
                self._keep(record)
            # What waits in the localizer is not in the belief: a recording begins when nothing does.
            if recorder is not None and (not is_first or belief is not None):
                recorder.append(record, estimates, belief, sought=sought)
        except SourceError:
            self._refused += 1
            log.exception("a record of a live source")

    def _tell(self) -> None:
        looked = due = -math.inf
        judged: RunResult | None = None
        while not self._stopped.is_set():
            before = time.perf_counter()
            if before - looked > CLOCKS_S:
                looked, self._clocks = before, self.session.clocks(self.run.scanner_names)
            snapshot = self.snapshot(None if before >= due else judged)
            self._publish(snapshot)
            if before >= due:
                after, judged = time.perf_counter(), snapshot.run.result
                due = after + (after - before) / TELLING_SHARE
            self._stopped.wait(TELL_S)
