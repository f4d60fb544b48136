"""Temporary landmarks on the floor: those that the filter has at the cursor, where it has them."""

from __future__ import annotations

import dataclasses

import numpy as np
import viser

from commission.app.base.drawing import RING_POINTS
from commission.app.base.state import AppState
from commission.app.base.view import view_of
from commission.app.run.playback import Playback
from commission.app.run.temporary_layer import TemporaryLayer, ages_of
from commission.localization.setup import LocalizerSetup
from commission.localization.whole_run import state_before
from commission.site.parameters import TemporaryParameters
from commission.studies.run import RunInput, judged_run
from commission.studies.start import Start, StartOrigin
from tests.paper_warehouse import yard


def test_landmarks_are_drawn_as_they_are_at_the_cursor() -> None:
    driven = yard(1)
    parameters = dataclasses.replace(driven.project.parameters, temporary=TemporaryParameters(enabled=True))
    project = dataclasses.replace(driven.project, parameters=parameters)
    start = Start(driven.start, StartOrigin.DRIVE)
    result = judged_run(RunInput.of(project, driven.log, start).with_setup(LocalizerSetup.of(project)))
    playback = Playback(result)
    assert playback.view(covered=False).temporary is None, "nothing is known before the first scan"
    playback.seek(10.0)
    view = playback.view(covered=False)
    known = state_before(result.columns, driven.log, view.lived).temporary
    assert known is not None and view.temporary == known and len(known) > 2
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        layer = TemporaryLayer(server.scene)
        shown = view_of(AppState(project=project, saved=project), view)
        layer.draw(shown)
        assert layer.is_used(shown)
        _, bodies, _, ellipses, *ages = layer.nodes()
        rings = bodies.points[: RING_POINTS * len(known), 0, :2]
        apart = np.hypot(*(rings[:, np.newaxis] - known.places_map).transpose(2, 0, 1)).min(axis=1)
        np.testing.assert_allclose(apart, 0.6, atol=0.1)
        around = ellipses.points[: len(known), 0, :2] - known.places_map[0]
        assert np.hypot(*around.T).max() <= 2.01 * np.sqrt(np.linalg.eigvalsh(known.place_covariances[0]).max())
        unseen = ages_of(known, view.estimate.stamp_ns if view.estimate else 0)
        assert [label.text for label in ages] == [f"{age:.0f} s" for _, age in unseen] and unseen
        playback.seek(0.0)
        layer.draw(view_of(AppState(project=project, saved=project), playback.view(covered=False)))
        assert len(layer.nodes()) == 4 and not layer.is_used(view_of(AppState(project=project, saved=project)))
    finally:
        server.stop()
