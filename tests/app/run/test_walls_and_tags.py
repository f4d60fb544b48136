"""Contours and tags on the page: beams that a wall explains or not, the table, tags and what a frame saw of them."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np
import pytest
import viser

from commission.app.base.state import AppState
from commission.app.base.view import PageView, view_of
from commission.app.editing.tag_layer import TagLayer
from commission.app.run.now_panel import rows
from commission.app.run.playback import Playback
from commission.app.run.sighting_layer import SightingLayer
from commission.app.run.view import RunView
from commission.app.run.wall_layers import WallPointLayer, WallTableLayer, table_picture
from commission.app.run.wall_points import walls_told
from commission.localization.contour import COLUMNS, DEPTH, MATCHED, USE, ContourUse
from commission.localization.setup import LocalizerSetup
from commission.localization.tags import TagUse
from commission.simulation.scenario import virtual_drive
from commission.site.disturbances import Reel
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.records import TagSightings
from commission.studies.run import RunInput, judged_run
from commission.studies.start import Start, StartOrigin
from tests.acceptance.test_every_kind import ROUTE, TAGS, project_of, start_in


@pytest.fixture(scope="module")
def server() -> Iterator[viser.ViserServer]:
    found = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield found
    found.stop()


def shown(project: Project, log: RecordLog, seconds: float) -> tuple[RunView, PageView]:
    inputs = RunInput.of(project, log, Start(start_in(project), StartOrigin.DRIVE))
    playback = Playback(judged_run(inputs.with_setup(LocalizerSetup.of(project))))
    playback.seek(seconds)
    view = playback.view(covered=False)
    return view, view_of(AppState(project=project, saved=project), view)


def test_beams_are_told_by_whether_a_wall_of_the_map_explains_them(server: viser.ViserServer) -> None:
    project = project_of("contours")
    # A reel that the map lacks, beside the way and in sight of the laser all along.
    goods = dataclasses.replace(project.disturbances, reels=(Reel(x=6.0, y=6.0, radius=0.4),))
    there = dataclasses.replace(project, disturbances=goods)
    view, page = shown(project, virtual_drive(there, ROUTE, seed=1), 2.5)
    walls = view.walls
    assert walls is not None and walls.figures[USE] == ContourUse.ACCEPTED
    # By hand: what lies within the reel's rim is matched with no wall, and no wall is unmatched.
    from_reel = np.hypot(*(walls.unmatched - (6.0, 6.0)).T)
    assert len(walls.unmatched) > 5 and np.mean(np.abs(from_reel - 0.4) < 0.1) > 0.9
    assert abs(len(walls.matched) - walls.figures[MATCHED]) <= 0.05 * len(walls.matched)
    told = dict(rows(view))
    assert told["Contours"].startswith("accepted, NIS ")
    assert told["Beams on walls"].startswith(f"{walls.figures[MATCHED]:.0f} of ")
    assert told["Beams end"] == f"{1000.0 * walls.figures[DEPTH]:.0f} mm behind the drawn walls"
    deep = dataclasses.replace(walls, figures=np.where(np.arange(COLUMNS) == DEPTH, 0.0426, walls.figures))
    assert dict(walls_told(deep))["Beams end"] == "43 mm behind the drawn walls"
    points, table = WallPointLayer(server.scene), WallTableLayer(server.scene)
    points.draw(page)
    table.draw_slowly(page)
    assert points.is_used(page) and len(table.nodes()) == 1
    assert [len(node.points) for node in points.nodes()[1::2]] == [len(walls.matched), len(walls.unmatched)]
    tables = view.segment.setup.contour.tables
    picture = table_picture(tables, project.parameters.contour.length)
    near = np.abs(tables.distances) < 0.5 * tables.resolution
    assert (picture[near, 3] > 70).all() and (picture[np.abs(tables.distances) > 2.0, 3] == 0).all()


def test_tags_are_drawn_with_what_a_frame_saw_of_them(server: viser.ViserServer) -> None:
    project = project_of("tags")
    drive = virtual_drive(project, ROUTE, seed=1)
    # A frame in the middle that reads the tag two metres off.
    frame = int(drive.tags.stamps_ns[20])
    wrong = TagSightings(frame + 1_000_000, np.array([(4.0, 1.5, 0.0, 0.02, 0.02, 0.02)]), ("1",))
    records = sorted([*drive.records(), wrong], key=lambda record: record.stamp_ns)
    log = RecordLog.collect(records, drive.scanners)
    view, page = shown(project, log, (wrong.stamp_ns + 1 - log.first_ns) * 1e-9)
    assert view.sightings is not None and view.sightings.uses.tolist() == [TagUse.REJECTED]
    assert dict(rows(view))["Tags: in, out, unused"] == "0, 1, 0"
    seen, tags = SightingLayer(server.scene), TagLayer(server.scene)
    seen.draw(page)
    tags.show_site(project)
    accepted, rejected, _ = seen.nodes()[1::2]
    assert np.ptp(rejected.points, axis=1).any() and not np.ptp(accepted.points, axis=1).any()
    before, page = shown(project, log, (frame - log.first_ns) * 1e-9)
    assert before.sightings is not None and before.sightings.uses.tolist() == [TagUse.ACCEPTED]
    np.testing.assert_allclose(before.sightings.places[0], TAGS[0].pose[:2], atol=0.15)
    seen.draw(page)
    assert np.ptp(seen.nodes()[1].points, axis=1).any()
    # The arrow of the tag points along its own x axis.
    tip = tags.nodes()[1].points[4, 1, :2] - tags.nodes()[1].points[4, 0, :2]
    np.testing.assert_allclose(np.arctan2(tip[1], tip[0]), TAGS[0].heading, atol=1e-5)
