"""Reads floor maps in the background: a file in, an action out, progress and cancel in between."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from commission.app.base.actions import PROGRAM, Action, Envelope, Sender
from commission.app.base.effects import Effect
from commission.app.base.jobs import Lane
from commission.app.base.reach import EVERYWHERE, Reach
from commission.app.base.service import Service
from commission.app.base.state import AppState
from commission.app.floor_map.actions import ImageMissing, MapFailed, MapMade, MapOpened
from commission.app.floor_map.draft import DRAWING_ENDINGS, ENDINGS, MAP_ENDINGS, PICTURE_ENDINGS, MapFile, Read
from commission.app.floor_map.effects import DrawMap, ReadMapFile, StopMapWork
from commission.errors import CommissionError, FileFormatError, JobError
from commission.io.dxf import Drawing, read_drawing
from commission.io.findings import Findings
from commission.io.image_map import Picture, read_picture
from commission.io.map_server import image_name, read_floor_map
from commission.io.mesh import Model, read_model
from commission.progress import Progress
from commission.site.floor_map import FloorMap

KEY = "floor map"
"""Of its jobs only the newest counts."""


class MapService(Service):
    """Does what loading a floor map asks for, one thing at a time: what is asked for next ends the one before."""

    effects = (ReadMapFile, DrawMap, StopMapWork)

    def carry_out(self, effect: Effect, state: AppState, sender: Sender) -> None:
        """Start or stop the work; its outcome is the action that follows, on behalf of who asked."""
        match effect:
            case ReadMapFile():
                asked = replace(effect, file=_within(effect.file, state.reach, sender))
                self._start(asked.job, lambda progress: read(asked, progress, state.reach, sender), sender)
            case DrawMap():
                self._start(effect.job, lambda progress: draw(effect, progress), sender)
            case _:
                self.context.jobs.cancel(KEY)

    def _start(self, name: str, work: Callable[[Progress], Action], sender: Sender) -> None:
        self.context.jobs.start(
            name,
            work,
            then=lambda action: Envelope(action, sender),
            failed=lambda job: Envelope(MapFailed(f"{job.name}: {job.error}"), sender),
            key=KEY,
            lane=Lane.FILES,
        )


def _within(file: MapFile, reach: Reach, sender: Sender) -> MapFile:
    """Return what a browser may read; a file of this computer as it is after all links."""
    return MapFile(reach.checked(file.source, sender)) if isinstance(file.source, Path) else file


def read(effect: ReadMapFile, progress: Progress, reach: Reach = EVERYWHERE, sender: Sender = PROGRAM) -> Action:
    """Read a file; what a person can mend comes back as `MapFailed`.

    Parameters
    ----------
    effect : which file, and how.
    progress : told how far the reading is; raises to cancel.
    reach, sender : where who asked may read: a map names the file of its image.
    """
    file = effect.file
    progress(0.0, "")

    def opened() -> Action:
        with _path_of(file) as path:
            if file.ending in MAP_ENDINGS:
                return _read_map(effect, path, reach, sender)
            return MapOpened(file, _read(effect, path, progress), effect.reading)

    return _or_failed(file, opened)


def draw(effect: DrawMap, progress: Progress) -> Action:
    """Make the floor map; what a person can mend comes back as `MapFailed`."""
    draft, file = effect.draft, effect.draft.file
    notes = draft.read.warnings if isinstance(draft.read, Drawing) else ()
    progress(0.0, "")
    return _or_failed(file, lambda: MapMade(file, _drawn(effect, progress), notes))


def _or_failed(file: MapFile, make: Callable[[], Action]) -> Action:
    """Return what is made of a file, or what a person can mend."""
    try:
        return make()
    except JobError:
        raise
    except FileFormatError as error:
        return MapFailed(str(_as_named(error, file)))
    except (CommissionError, ValueError) as error:
        return MapFailed(f"{file.name}: {error}")


def _drawn(effect: DrawMap, progress: Progress) -> FloorMap:
    draft, options = effect.draft, effect.draft.options
    match draft.read:
        case Drawing():
            return draft.read.floor_map(options.resolution, options.layers, progress)
        case Model():
            return draft.read.floor_map(options.heights, options.resolution, progress)
        case Picture():
            placement = draft.placement()
            if placement is None:
                raise ValueError("its scale is not known; expected two points, clicked on the image")
            return draft.read.floor_map(placement, threshold=options.threshold, light_walls=options.light_walls)


def _read(effect: ReadMapFile, path: Path, progress: Progress) -> Read:
    file, reading = effect.file, effect.reading
    if file.ending in DRAWING_ENDINGS:
        return read_drawing(path, unit=reading.unit or None, progress=progress)
    if file.ending in PICTURE_ENDINGS:
        return read_picture(path)
    if file.ending in ENDINGS:
        up = None if not reading.up else reading.up == "y"
        return read_model(path, unit=reading.unit or None, y_up=up, progress=progress)
    known = ", ".join(f".{ending}" for ending in ENDINGS)
    raise FileFormatError(path, "", f"ends in {path.suffix!r}", f"a floor map: {known}")


def _read_map(effect: ReadMapFile, path: Path, reach: Reach, sender: Sender) -> Action:
    """Read a `map_server` map: its image lies beside it, or was sent, too."""
    file, image, found = effect.file, effect.image, Findings()
    if isinstance(file.source, Path):
        reach.checked(path.parent / image_name(path), sender)
        return MapMade(file, read_floor_map(path, found=found), found.lines())
    name = image_name(path)
    if image is None or image.name != name:
        return ImageMissing(file, name)
    with _path_of(image) as image_path:
        return MapMade(file, read_floor_map(path, image=image_path, found=found), found.lines())


@contextmanager
def _path_of(file: MapFile) -> Generator[Path]:
    """Give a path to read a file from."""
    if isinstance(file.source, Path):
        yield file.source
        return
    with file.source.as_file() as path:
        yield path


def _as_named(error: FileFormatError, file: MapFile) -> FileFormatError:
    """Return the error with the name that the person knows: not that of a temporary file."""
    if isinstance(file.source, Path):
        return error
    return FileFormatError(file.name, error.where, error.problem, error.remedy)
