"""Floor maps read as jobs: every kind of file, from a path or from a browser, broken ones, and large ones stopped."""

from __future__ import annotations

import math
import queue
import shutil
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import ezdxf
import numpy as np
import pytest
import trimesh
from PIL import Image

from commission.app.base.actions import PROGRAM, Action
from commission.app.base.effects import Effect
from commission.app.base.jobs import JobReport, Jobs, JobState
from commission.app.base.service import Context
from commission.app.base.state import AppState
from commission.app.base.uploads import Upload
from commission.app.floor_map.actions import ImageMissing, MapFailed, MapMade, MapOpened
from commission.app.floor_map.draft import MapDraft, MapFile, MapLoading, MapOptions, ReadOptions
from commission.app.floor_map.effects import DrawMap, ReadMapFile, StopMapWork
from commission.app.floor_map.work import MapService, draw, read
from commission.io.dxf import Drawing
from commission.io.image_map import Picture
from commission.io.map_server import write_floor_map
from commission.io.mesh import Model
from commission.site.floor_map import FREE, OCCUPIED, FloorMap
from commission.site.project import Project
from tests.app.asking import after
from tests.conftest import few_of
from tests.io.large_files import write_drawing, write_stl

STATE = AppState(project=Project(), saved=Project())
HALL = FloorMap(np.where(np.eye(30, 40, dtype=bool), np.int8(OCCUPIED), np.int8(FREE)), 0.05, np.array([1.0, 2.0, 0.0]))


def silent(_fraction: float, _message: str = "") -> None:
    pass


def uploaded(path: Path, name: str = "") -> MapFile:
    """The file as a browser would send it."""
    return MapFile(Upload(name or path.name, path.read_bytes()))


def outcome(file: MapFile, reading: ReadOptions | None = None, image: MapFile | None = None) -> Action:
    return read(ReadMapFile(file, reading or ReadOptions(), image), silent)


def drawn(file: MapFile, options: MapOptions, reading: ReadOptions | None = None, **changes: object) -> FloorMap:
    """The floor map that a file becomes."""
    opened = outcome(file, reading)
    assert isinstance(opened, MapOpened), opened
    made = draw(DrawMap(replace(MapDraft(file=file, read=opened.read, options=options), **changes)), silent)
    assert isinstance(made, MapMade), made
    return made.floor_map


def failure(file: MapFile, image: MapFile | None = None) -> str:
    failed = outcome(file, image=image)
    assert isinstance(failed, MapFailed), failed
    assert "\n" not in failed.text
    return failed.text


def test_a_ros_map_is_read_from_a_path_and_from_two_uploads(tmp_path: Path) -> None:
    write_floor_map(HALL, tmp_path / "hall.yaml")
    by_path = outcome(MapFile(tmp_path / "hall.yaml"))
    assert by_path == MapMade(MapFile(tmp_path / "hall.yaml"), HALL)
    yaml, image = uploaded(tmp_path / "hall.yaml"), uploaded(tmp_path / "hall.png")
    assert outcome(yaml) == ImageMissing(yaml, "hall.png")
    assert outcome(yaml, image=image) == MapMade(yaml, HALL)


def test_what_is_doubted_in_a_ros_map_is_said_beside_it(tmp_path: Path) -> None:
    write_floor_map(HALL, tmp_path / "hall.yaml")
    text = (tmp_path / "hall.yaml").read_text().replace("hall.png", "/home/robot/maps/hall.png")
    (tmp_path / "hall.yaml").write_text(text)
    made = outcome(MapFile(tmp_path / "hall.yaml"))
    note = "the image '/home/robot/maps/hall.png' is not read; hall.png beside hall.yaml is taken"
    assert made == MapMade(MapFile(tmp_path / "hall.yaml"), HALL, (note,))
    assert note in after(STATE, made).state.part(MapLoading).notes


@pytest.mark.parametrize("reference", ["/home/robot/maps/hall.png", "../../maps/hall.png", "maps\\hall.png"])
def test_an_uploaded_map_never_leads_to_a_file_of_this_computer(tmp_path: Path, reference: str) -> None:
    write_floor_map(HALL, tmp_path / "hall.yaml")
    text = (tmp_path / "hall.yaml").read_text().replace("hall.png", f"'{reference}'")
    yaml = MapFile(Upload("hall.yaml", text.encode()))
    assert outcome(yaml) == ImageMissing(yaml, "hall.png")
    assert outcome(yaml, image=uploaded(tmp_path / "hall.png")) == MapMade(yaml, HALL)


def plan(folder: Path, draw_on: Callable[[ezdxf.document.Drawing], None], units: int = 4) -> Path:
    document = ezdxf.new("R2010", units=units)
    draw_on(document)
    document.saveas(folder / "plan.dxf")
    return folder / "plan.dxf"


def square(document: ezdxf.document.Drawing) -> None:
    document.modelspace().add_lwpolyline(
        [(0, 0), (10_000, 0), (10_000, 4_000), (0, 4_000)], close=True, dxfattribs={"layer": "WALLS"}
    )
    document.modelspace().add_line((5_000, 0), (5_000, 4_000), dxfattribs={"layer": "RACKS"})


@pytest.mark.parametrize("by_upload", [False, True])
def test_a_drawing_becomes_the_walls_of_the_chosen_layers_in_its_unit(tmp_path: Path, by_upload: bool) -> None:
    path = plan(tmp_path, square)
    file = uploaded(path) if by_upload else MapFile(path)
    both, walls = drawn(file, MapOptions()), drawn(file, MapOptions(layers=("WALLS",)))
    assert walls.size == pytest.approx((12.1, 6.1), abs=0.11)
    racks = [(5.02, y) for y in np.linspace(0.5, 3.5, 20)]
    assert both.occupancy().is_occupied(racks).all()
    assert not walls.occupancy().is_occupied(racks).any()
    assert walls.occupancy().is_occupied([(x, 0.02) for x in np.linspace(0.5, 9.5, 20)]).all()
    in_cm = drawn(file, MapOptions(), ReadOptions(unit="cm"))
    assert in_cm.size == pytest.approx((102.1, 42.1), abs=0.11)


def test_a_model_becomes_its_sections_at_the_chosen_heights(tmp_path: Path) -> None:
    hall = trimesh.creation.box((10.0, 6.0, 3.0), trimesh.transformations.translation_matrix((5.0, 3.0, 1.5)))
    beam = trimesh.creation.box((1.0, 1.0, 0.5), trimesh.transformations.translation_matrix((5.0, 3.0, 2.0)))
    trimesh.util.concatenate([hall, beam]).export(tmp_path / "hall.stl")
    file = MapFile(tmp_path / "hall.stl")
    low, both = drawn(file, MapOptions()), drawn(file, MapOptions(heights=(0.2, 2.0)))
    side = [(4.52, y) for y in np.linspace(2.6, 3.4, 10)]
    wall = [(x, 0.02) for x in np.linspace(0.5, 9.5, 20)]
    for each in (low, both):
        assert each.occupancy().is_occupied(wall).all()
    assert not low.occupancy().is_occupied(side).any()
    assert both.occupancy().is_occupied(side).all()
    opened = outcome(file, ReadOptions(unit="mm"))
    assert isinstance(opened, MapOpened) and isinstance(opened.read, Model)
    np.testing.assert_allclose(opened.read.bounds, [[0, 0, 0], [0.010, 0.006, 0.003]], atol=1e-9)


def test_an_image_becomes_walls_at_the_place_and_scale_of_its_two_points(tmp_path: Path) -> None:
    pixels = np.full((60, 100), 255, np.uint8)
    pixels[50] = 0
    Image.fromarray(pixels).save(tmp_path / "plan.png")
    options = MapOptions(distance=8.0, direction=math.pi / 2, first_in_map=(3.0, 1.0))
    floor_map = drawn(uploaded(tmp_path / "plan.png"), options, pixels=((10.0, 50.5), (90.0, 50.5)))
    assert floor_map.resolution == pytest.approx(0.1)
    # The dark row runs along y now, from (3, 1) on.
    assert floor_map.occupancy().is_occupied([(3.0, y) for y in np.linspace(0.05, 9.9, 30)]).all()
    assert not floor_map.occupancy().is_occupied([(2.8, 5.0), (3.2, 5.0)]).any()
    opened = outcome(uploaded(tmp_path / "plan.png"))
    assert isinstance(opened, MapOpened)
    unplaced = draw(DrawMap(MapDraft(file=opened.file, read=opened.read)), silent)
    assert isinstance(unplaced, MapFailed) and "expected two points" in unplaced.text


def test_broken_files_say_in_one_line_what_is_wrong_under_the_name_that_they_have(tmp_path: Path) -> None:
    (tmp_path / "map.yaml").write_text("image: map.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n")
    assert "'map.pgm' does not exist" in failure(MapFile(tmp_path / "map.yaml"))
    (tmp_path / "map.pgm").write_bytes(b"P5\n100 100\n255\n" + bytes(500))
    assert "is no readable image" in failure(MapFile(tmp_path / "map.yaml"))
    truncated = failure(uploaded(tmp_path / "map.yaml"), image=uploaded(tmp_path / "map.pgm"))
    assert truncated.startswith("map.yaml: is no readable image")
    assert failure(MapFile(Upload("<i>a</i>.dxf", b"garbage\n"))).startswith("<i>a</i>.dxf: line 1: is 'garbage'")
    assert failure(MapFile(Upload("hall.stl", b"solid"))).startswith("hall.stl: ")
    assert failure(MapFile(Upload("plan.png", b"\x89PNG"))).startswith("plan.png: is no readable image")
    assert failure(MapFile(Upload("map.yaml", b"image: [")))
    assert "does not exist" in failure(MapFile(tmp_path / "nowhere.dxf"))
    assert "is a folder" in failure(MapFile(_folder(tmp_path / "folder.png")))
    shutil.rmtree(tmp_path / "folder.png")
    opened = outcome(MapFile(plan(tmp_path, lambda document: None)))
    assert isinstance(opened, MapOpened)
    empty = draw(DrawMap(MapDraft(file=opened.file, read=opened.read)), silent)
    assert isinstance(empty, MapFailed) and "holds no lines to draw" in empty.text


def _folder(path: Path) -> Path:
    path.mkdir()
    return path


def test_no_temporary_file_stays_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    failure(MapFile(Upload("../../etc/hall.stl", b"solid")))
    failure(MapFile(Upload("hall.png", b"")))
    assert list(tmp_path.iterdir()) == []


class Stopping:
    """Jobs of which the running one is stopped at its nth report of progress."""

    def __init__(self, stop_at: int | None) -> None:
        self.stop_at = stop_at
        self.fractions: list[float] = []
        self._ends: queue.SimpleQueue[JobReport] = queue.SimpleQueue()
        self._jobs = Jobs(self._heard)
        context = Context(STATE, lambda _message: None, time.monotonic, self._jobs)
        self._service = MapService(context)

    def _heard(self, report: JobReport) -> None:
        if report.job.state is JobState.RUNNING:
            self.fractions.append(report.job.fraction)
            if self.stop_at is not None and len(self.fractions) >= self.stop_at:
                self._service.carry_out(StopMapWork(), STATE, PROGRAM)
        elif report.job.state is not JobState.WAITING:
            self._ends.put(report)

    def run(self, effect: Effect) -> JobReport:
        self._service.carry_out(effect, STATE, PROGRAM)
        return self._ends.get(timeout=120.0)


@pytest.mark.slow
@pytest.mark.parametrize("name", few_of(("drawing.dxf", "model.stl"), ("model.stl",)))
def test_a_large_file_loads_as_a_job_with_progress_and_is_stopped_on_the_way(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    if path.suffix == ".dxf":
        write_drawing(path, 200_000)
    else:
        write_stl(path, 100_000_000)
    whole = Stopping(None)
    report = whole.run(ReadMapFile(MapFile(path)))
    opened = report.result
    assert isinstance(opened, MapOpened)
    if isinstance(opened.read, Drawing):
        assert len(opened.read.segments) >= 200_000
    else:
        assert isinstance(opened.read, Model)
        assert len(opened.read.triangles) == (100_000_000 - 84) // 50
    assert len({round(fraction, 1) for fraction in whole.fractions}) >= 4
    made = Stopping(None).run(DrawMap(MapDraft(file=opened.file, read=opened.read))).result
    assert isinstance(made, MapMade)
    # The corners were drawn over 180 x 80 m, with 1 m of floor around.
    assert made.floor_map.size == pytest.approx((182.0, 82.0), rel=0.1)
    for effect in (ReadMapFile(MapFile(path)), DrawMap(MapDraft(file=opened.file, read=opened.read))):
        stopped = Stopping(2)
        assert stopped.run(effect).job.state is JobState.CANCELLED
        assert max(stopped.fractions) < 0.9


def test_a_picture_is_read_whole(tmp_path: Path) -> None:
    Image.fromarray(np.zeros((3, 5), np.uint8)).save(tmp_path / "a.png")
    opened = outcome(MapFile(tmp_path / "a.png"))
    assert isinstance(opened, MapOpened) and isinstance(opened.read, Picture)
    assert opened.read.size == (5, 3)
