import threading
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from commission.app.base import actions
from commission.app.base.actions import Action, Camera, Envelope, LookAgain, Sender, SetCamera
from commission.app.base.effects import Effect, PlaceCamera, Tell
from commission.app.base.feature import Feature
from commission.app.base.service import Context, Service
from commission.app.base.state import AppState
from commission.app.base.view import PageView
from commission.app.project.actions import ProjectSaved, Save
from commission.app.project.effects import WriteProject
from commission.app.project.state import FilesState
from commission.app.run.actions import (
    ChooseSource,
    Cover,
    Play,
    RecordedDrive,
    Repeat,
    Seek,
    SetSpeed,
    Source,
    VirtualDrive,
)
from commission.app.run.drives import Drive
from commission.app.run.service import RunService
from commission.app.run.state import RunState
from commission.app.run.view import RunView
from commission.app.runtime import SLOW_FRAME_S, BrowserCame, BrowserLeft, Runtime
from commission.app.tune.actions import SetParameter
from commission.errors import FileFormatError
from commission.progress import Progress
from commission.site.project import Project
from tests.app.asking import FEATURES, by


def cycles(view: PageView) -> int:
    run = view.part(RunView)
    return 0 if run is None else run.lived


class Pictures:
    """A page that remembers what it was told."""

    def __init__(self) -> None:
        self.views: list[PageView] = []
        self.told: list[tuple[str, bool]] = []
        self.browsers: list[int] = []
        self.shown: list[tuple[int | None, Camera]] = []
        self.fail_once = False

    def show_site(self, state: AppState) -> None:
        pass

    def draw(self, view: PageView, *, slowly: bool) -> None:
        if self.fail_once:
            self.fail_once = False
            raise RuntimeError("no such thing")
        self.views.append(view)

    def carry_out(self, effect: Effect, sender: Sender) -> None:
        match effect:
            case Tell(text, failed):
                self.told.append((text, failed))
            case PlaceCamera(camera):
                self.shown.append((sender.browser, camera))
            case _:
                raise TypeError(f"nobody asks for {effect} here")

    def connected(self, browser: int) -> None:
        self.browsers.append(browser)

    def disconnected(self, browser: int) -> None:
        self.browsers.remove(browser)


class Saving(Service):
    """Remembers where a project was to be written."""

    effects = (WriteProject,)

    def __init__(self, context: Context, saved: list[Path]) -> None:
        super().__init__(context)
        self._saved = saved

    def carry_out(self, effect: Effect, state: AppState, sender: Sender) -> None:
        assert isinstance(effect, WriteProject)
        self._saved.append(effect.folder)
        self.context.post(ProjectSaved(effect.project, effect.folder, "12:03"))


class Bench:
    """A runtime with a drive that is there at once, and a page that only remembers."""

    def __init__(self, project: Project, drive: Drive) -> None:
        self.page = Pictures()
        self.saved: list[Path] = []
        self.drive = drive
        self.slow: Callable[..., Drive] | None = None
        self.runtime = Runtime(AppState(project=project, saved=project, folder=Path("hall")), self._features())

    def _features(self) -> list[Feature]:
        run = partial(RunService, prepare=self._prepare, compile_all=lambda _progress: None)
        others = [feature for feature in FEATURES if feature.name not in ("run", "project")]
        return [
            *others,
            Feature(name="run", services=(run,)),
            Feature(name="project", services=(partial(Saving, saved=self.saved),)),
        ]

    def _prepare(self, _project: Project, source: Source, progress: Progress) -> Drive:
        if self.slow is not None:
            return self.slow(_project, source, progress)
        progress(0.5, "")
        if isinstance(source, RecordedDrive):
            raise FileFormatError(source.path, "", "not a recording", "a folder with odometry.csv")
        return self.drive

    @property
    def run(self) -> RunView | None:
        return self.runtime.service(RunService).view()

    @property
    def lived(self) -> int:
        return 0 if self.run is None else self.run.lived

    def post(self, *asked: Action | Envelope) -> None:
        for each in asked:
            self.runtime.post(each)

    def until(self, reached: Callable[[], bool]) -> None:
        """Wait until something has happened, at most 20 s: compilation included."""
        for _ in range(2000):
            if reached():
                return
            time.sleep(0.01)
        raise TimeoutError("it did not happen within 20 s")

    def play(self) -> None:
        self.post(ChooseSource(VirtualDrive("There and back")))
        self.until(lambda: self.lived > 0)


@pytest.fixture
def bench(project: Project, drive: Drive):
    bench = Bench(project, drive)
    bench.runtime.start(bench.page)
    yield bench
    bench.runtime.stop()


def test_a_chosen_drive_plays_by_itself_and_pictures_follow(bench: Bench) -> None:
    bench.play()
    bench.until(lambda: any(cycles(view) > 3 for view in bench.page.views))
    assert bench.runtime.state.part(RunState).playing


def test_pictures_come_at_most_25_times_a_second(bench: Bench) -> None:
    bench.play()
    bench.post(SetSpeed(50.0))
    before, since = len(bench.page.views), time.monotonic()
    time.sleep(1.0)
    rate = (len(bench.page.views) - before) / (time.monotonic() - since)
    assert rate <= 27.0  # 25 and the two pictures at the ends of the interval


def test_a_recording_that_cannot_be_read_is_told_and_listed_and_the_page_lives_on(bench: Bench) -> None:
    shown = bench.runtime.state.part(RunState).source
    bench.post(ChooseSource(RecordedDrive(Path("nothing"))))
    bench.until(lambda: bool(bench.page.told))
    assert bench.runtime.state.part(RunState).source is shown, "what drives is still what drove before"
    assert "not a recording" in bench.page.told[0][0]
    assert bench.page.told[0][1]
    assert len(bench.runtime.state.faults) == 1
    bench.play()


def test_a_mistake_of_ours_while_drawing_is_listed_and_the_page_lives_on(bench: Bench) -> None:
    bench.page.fail_once = True
    bench.play()
    bench.until(lambda: bool(bench.runtime.state.faults))
    assert "a fault of the program (RuntimeError)" in bench.runtime.state.faults[0]
    bench.until(lambda: len(bench.page.views) > 3)


def test_a_value_out_of_range_is_told_and_changes_nothing(bench: Bench) -> None:
    before = bench.runtime.state.project
    bench.post(Envelope(SetParameter("association.gate_probability", 7.0), Sender(1)))
    bench.until(lambda: bool(bench.page.told))
    assert "gate_probability is 7" in bench.page.told[0][0]
    assert bench.runtime.state.project is before


def test_of_many_seeks_in_a_row_the_last_one_counts(bench: Bench) -> None:
    bench.play()
    bench.post(Play(playing=False), *(Seek(0.1 * k) for k in range(50)))
    bench.until(lambda: bench.run is not None and abs(bench.run.time - 4.9) < 1e-6)


def test_the_drive_stops_at_its_end_or_starts_again(bench: Bench) -> None:
    bench.play()
    bench.post(Repeat(repeat=False), SetSpeed(50.0))
    bench.until(lambda: not bench.runtime.state.part(RunState).playing)
    assert bench.run is not None
    assert bench.run.at_end
    bench.post(Repeat(repeat=True), Play(playing=True))
    bench.until(lambda: bench.run is not None and 0.0 < bench.run.time < 0.5 * bench.run.duration)
    assert bench.runtime.state.part(RunState).playing


def test_covering_reaches_the_next_scan(bench: Bench) -> None:
    bench.play()
    bench.post(Cover(covered=True))

    def sees_nothing() -> bool:
        estimate = None if bench.run is None else bench.run.estimate
        return estimate is not None and len(estimate.status) == 0

    bench.until(sees_nothing)


def test_saving_is_told_with_the_folder_and_the_time_of_day(bench: Bench) -> None:
    bench.post(SetParameter("association.gate_probability", 0.9), Save())
    bench.until(lambda: bool(bench.runtime.state.part(FilesState).saved_at))
    assert bench.saved == [Path("hall")]
    assert not bench.runtime.state.is_changed


def test_each_browser_has_its_own_view(bench: Bench) -> None:
    bench.runtime.post(BrowserCame(1))
    bench.runtime.post(BrowserCame(2))
    bench.post(by(2, SetCamera(Camera.THREE_D)))
    bench.runtime.post(BrowserLeft(1))
    bench.until(lambda: bench.page.browsers == [2])
    assert bench.page.shown == [(2, Camera.THREE_D)]


def test_a_job_in_sight_is_stopped_by_its_button_and_what_there_was_stays(bench: Bench) -> None:
    bench.play()
    bench.until(lambda: bool(bench.page.views) and not bench.page.views[-1].jobs)
    before = bench.run
    started, end = threading.Event(), threading.Event()

    def prepare(_project: Project, _source: Source, progress: Progress) -> Drive:
        started.set()
        while not end.wait(0.01):
            progress(0.5, "")
        raise TimeoutError("nobody stopped it")

    bench.slow = prepare
    bench.post(ChooseSource(VirtualDrive("There and back")))
    assert started.wait(20.0)
    bench.until(lambda: bool(bench.page.views) and bool(bench.page.views[-1].jobs))
    (job,) = bench.page.views[-1].jobs
    assert job.line.startswith("Preparing the drive")
    bench.post(actions.StopJob(job.number))
    bench.until(lambda: not bench.page.views[-1].jobs)
    end.set()
    assert bench.run is not None
    assert before is not None
    assert bench.run.result is before.result
    assert bench.page.told == []


def test_what_a_browser_asks_for_is_drawn_whole_within_a_tenth_of_a_second_and_a_drive_as_before() -> None:
    project, now = Project(name="x"), [100.0]
    runtime = Runtime(AppState(project=project, saved=project), (), clock=lambda: now[0])
    pictures: list[tuple[float, bool]] = []

    class Page(Pictures):
        def draw(self, view: PageView, *, slowly: bool) -> None:
            pictures.append((round(now[0] - 100.0, 3), slowly))

    runtime._page = Page()

    def let(seconds: float, every: Action | Envelope | None = None) -> None:
        for _ in range(round(seconds / 0.02)):
            now[0] += 0.02
            if every is not None:
                runtime.handle(every)
            runtime.tick()

    let(0.5, LookAgain())
    whole = [at for at, slowly in pictures if slowly]
    assert np.diff(whole) == pytest.approx(np.full(len(whole) - 1, SLOW_FRAME_S), abs=0.021)
    while not pictures[-1][1]:  # until one was drawn this moment
        let(0.02, LookAgain())
    asked = now[0] - 100.0
    pictures.clear()
    runtime.handle(by(1, LookAgain()))
    let(0.1)
    assert min(at for at, slowly in pictures if slowly) - asked < 0.09


def test_who_asks_without_a_pause_leaves_the_owner_thread_most_of_its_time() -> None:
    project, now, took = Project(name="x"), [100.0], 0.05
    runtime = Runtime(AppState(project=project, saved=project), (), clock=lambda: now[0])
    whole: list[float] = []

    class Page(Pictures):
        def draw(self, view: PageView, *, slowly: bool) -> None:
            if slowly:
                whole.append(now[0])
                now[0] += took

    runtime._page = Page()
    for _ in range(200):
        now[0] += 0.01
        runtime.handle(by(1, LookAgain()))
        runtime.tick()
    gaps = np.diff(whole[1:])
    assert len(gaps) > 5
    assert gaps.min() >= 3.0 * took
    assert gaps.max() <= SLOW_FRAME_S + 0.02
