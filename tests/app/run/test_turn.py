"""Bearings of a turn on the page: lines from where the goniometer was, and the numbers beside them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import viser

from commission.app.base.state import AppState
from commission.app.base.view import view_of
from commission.app.run.bearing_layer import BearingLayer
from commission.app.run.now_panel import rows
from commission.app.run.playback import Playback
from commission.app.run.summary_panel import summary
from commission.geometry import se2
from commission.localization.bearings import BearingUse
from commission.localization.setup import LocalizerSetup
from commission.simulation.scenario import virtual_drive
from commission.site.record_log import RecordLog
from commission.site.records import Reflex
from commission.studies.run import RunInput, judged_run
from commission.studies.start import Start, StartOrigin
from tests.acceptance.test_every_kind import GONIOMETER, ROUTE, project_of, start_in


def lines_of(node: Any) -> int:
    """Lines that are longer than nothing."""
    return int(np.count_nonzero(np.ptp(node.points, axis=1).any(axis=-1)))


def test_a_turn_is_drawn_and_told_beside_the_scan_that_came_before_it() -> None:
    project = project_of("reflectors by range and bearing, and bearings")
    drive = virtual_drive(project, ROUTE, seed=1)
    # One bearing of something that is no reflector, in the middle of the drive.
    wrong = Reflex(int(drive.bearings.stamps_ns[60]) + 1_000_000, float(drive.bearings.bearings[60]) + 0.4)
    log = RecordLog.collect([*drive.records(), wrong], drive.scanners)
    result = judged_run(
        RunInput.of(project, log, Start(start_in(project), StartOrigin.DRIVE)).with_setup(LocalizerSetup.of(project))
    )
    playback = Playback(result)
    assert playback.view(covered=False).turn is None or not len(playback.view(covered=False).turn.uses)
    playback.seek((wrong.stamp_ns + 1 - log.first_ns) * 1e-9)
    view = playback.view(covered=False)
    turn, columns = view.turn, result.columns
    assert turn is not None and columns.is_reflex(view.newest) and columns.is_scan(view.seen)
    assert view.estimate is not None and view.estimate.stamp_ns == columns.stamps_ns[view.seen] and len(view.gates)
    assert (turn.count(BearingUse.ACCEPTED), turn.count(BearingUse.REJECTED)) == (3, 1)
    # By hand: lines begin at the goniometer, accepted ones end at a post, the rejected one points where it was seen.
    at = se2.compose(columns.means[view.newest], GONIOMETER.mounting)
    np.testing.assert_allclose(turn.lines[-1, 0], at[:2], atol=1e-9)
    along = turn.lines[-1, 1] - turn.lines[-1, 0]
    assert math.isclose(
        math.remainder(math.atan2(along[1], along[0]) - at[2] - wrong.bearing, 2 * math.pi), 0.0, abs_tol=1e-9
    )
    ends = turn.lines[turn.uses == BearingUse.ACCEPTED, 1]
    apart = np.hypot(*(ends[:, np.newaxis] - project.reflectors.centers).transpose(2, 0, 1)).min(axis=1)
    assert apart.max() < 0.05
    told = dict(rows(view))
    assert told["Bearings of a turn"] == "3 accepted, 1 rejected, 0 unused"
    assert told["Bearings, largest NIS / gate"].endswith(" / 10.83")
    assert told["Inliers"] == "3"
    assert "Bearings accepted / rejected" in summary(result, ())
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        layer, shown = BearingLayer(server.scene), view_of(AppState(project=project, saved=project), view)
        layer.draw(shown)
        assert layer.is_used(shown)
        assert [lines_of(node) for node in layer.nodes()[1::2]] == [0, 1, 3]
        playback.seek(0.0)
        layer.draw(view_of(AppState(project=project, saved=project), playback.view(covered=False)))
        assert not any(lines_of(node) for node in layer.nodes())
    finally:
        server.stop()
