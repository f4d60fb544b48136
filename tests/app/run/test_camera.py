"""A recording with a contour: both tracks of its camera on the floor and in figures; without one, nothing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import viser

from commission.app.base.state import AppState
from commission.app.base.view import view_of
from commission.app.run.actions import RecordedDrive, VirtualDrive
from commission.app.run.camera_layer import CameraLayer
from commission.app.run.camera_panel import camera_html
from commission.app.run.drives import Drive
from commission.app.run.effects import LoadSource
from commission.site.project import Project
from commission.studies.run import RunResult
from commission.studies.vision import VisionResult
from tests.app.run.test_service import RunBench
from tests.virtual_camera import Camera, board, seen


def write_contour(folder: Path, result: RunResult, contour: np.ndarray) -> None:
    """Write what a camera sees of a board while the vehicle drives the first metres."""
    means = result.columns.means
    way = np.hypot(*(means[:, :2] - means[0, :2]).T)
    last = int(np.argmax(way > 2.5)) or len(way)
    frames = np.arange(0, last, 2)
    # What the filter says is taken for true here: the study's own tests have a truth besides.
    rng, camera = np.random.default_rng(5), Camera()
    pixels = seen(means[frames], camera, rng, contour=contour)
    rows = [
        f"{result.columns.stamps_ns[k]},{i},{u / camera.focal_length!r},{v / camera.focal_length!r}\n"
        for k, frame in zip(frames, pixels.tolist(), strict=True)
        for i, (u, v) in enumerate(frame)
    ]
    (folder / "contour.csv").write_text("stamp_ns,point,u,v\n" + "".join(rows), encoding="utf-8")


@pytest.fixture
def bench(project: Project, drive: Drive) -> Iterator[RunBench]:
    bench = RunBench(project, drive)
    yield bench
    bench.owner.close()


def shown(bench: RunBench) -> VisionResult | None:
    return view_of(bench.state, *bench.service.parts(slowly=True)).part(VisionResult)


def test_both_tracks_are_drawn_and_told(bench: RunBench, project: Project, result: RunResult, tmp_path: Path) -> None:
    write_contour(tmp_path, result, board() + np.array([0.2, -0.1]))
    bench.do(LoadSource(RecordedDrive(tmp_path)))
    found = shown(bench)
    assert found is not None
    depth = found.constant("depth")
    assert abs(depth.value - 7.7) < 4.0 * depth.sigma
    told = camera_html(found)
    assert "Difference to the laser" in told
    assert f"{1000.0 * depth.value:.0f} ± {1000.0 * depth.sigma:.0f} mm" in told
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        layer = CameraLayer(server.scene)
        layer.draw_slowly(view_of(bench.state, found))
        lines = [node for node in layer.nodes() if not node.name.endswith("_casing")]
        for node, track in zip(lines, (found.laser_map, found.camera_map), strict=True):
            assert node.points[0, 0, :2] == pytest.approx(track[0, :2], abs=1e-5)
            assert node.points[-1, 1, :2] == pytest.approx(track[-1, :2], abs=1e-5)
        assert layer.is_used(view_of(bench.state, found))
        layer.draw_slowly(view_of(AppState(project=project, saved=project)))
        assert all(len(node.points) <= 1 for node in layer.nodes())
    finally:
        server.stop()
    bench.drives.append(replace(bench.drives[0], log=replace(bench.drives[0].log)))
    bench.do(LoadSource(VirtualDrive("There and back")))
    assert shown(bench) is None


def test_a_contour_that_tells_nothing_is_told_with_its_reason(
    bench: RunBench, result: RunResult, tmp_path: Path
) -> None:
    write_contour(tmp_path, result, board() * np.array([1.0, 0.0]))
    bench.do(LoadSource(RecordedDrive(tmp_path)))
    assert shown(bench) is None
    assert any("is a line" in str(action) for action in bench.owner.posted)
