"""A person throws the pose away, reads where the vehicle may be, and sees it found by driving."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from commission.app.run.actions import Seek
from commission.localization.estimate import Mode
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorMap
from tests.app.sites import room
from tests.browser.page import SMALL, OpenPage
from tests.browser.serving import standing_drive


def turned_alike() -> Project:
    """A room whose four reflectors look the same from the other end of it."""
    project = room()
    places = ((0.25, 2.0), (0.25, 6.0), (11.75, 2.0), (11.75, 6.0))
    return replace(
        project, reflectors=ReflectorMap(tuple(Reflector(id=f"R{i + 1}", x=x, y=y) for i, (x, y) in enumerate(places)))
    )


def test_a_person_throws_the_pose_away_and_reads_where_the_vehicle_may_be(window: Callable[..., OpenPage]) -> None:
    with standing_drive(turned_alike(), at=3.05) as served:
        page = window(served.server, SMALL)
        page.open()
        page.open_tab("Run")
        page.press("Locate")
        served.until(lambda: served.view is not None and any(s.locate for s in served.view.result.columns.segments))
        served.runtime.post(Seek(4.05))
        page.wait_for_text("Where it may be")
        page.wait_for_text("Ambiguous: 2 places fit")
        page.wait_for_text("INITIALIZING")
        view = served.view
        assert view is not None
        one, other = view.hypotheses[:2]
        assert one.probability + other.probability > 0.99
        # By symmetry the other one is the first turned about the middle of the room.
        assert np.allclose(one.pose[:2] + other.pose[:2], (12.0, 8.0), atol=0.05)
        rows = page.page.locator(".c-hypotheses tr")
        assert rows.count() == 3
        first = rows.nth(1).inner_text().split("\t")
        assert first[1] == f"{100 * one.probability:.1f}"
        assert first[2] == f"{one.pose[0]:.2f}, {one.pose[1]:.2f}"
        table = page.page.locator(".c-hypotheses table").bounding_box()
        box = page.page.locator(".c-hypotheses").bounding_box()
        assert table is not None
        assert box is not None
        assert table["x"] + table["width"] <= box["x"] + box["width"]
        assert page.page.evaluate("() => Boolean(window.__viserMutable.nodeRefFromName['/run/hypotheses'])")
        page.wait_for_text("where it may be, 2σ")
        assert Mode.OPERATIONAL not in view.result.columns.modes[view.newest :], "never believed while two are alike"
