"""The list of shiny things: whose drive it is of, when it is looked for, and what the page's script may ask."""

from __future__ import annotations

from dataclasses import replace

import pytest

from commission.app.base.actions import LookAgain
from commission.app.base.drive_now import DriveNow
from commission.app.base.effects import FlyTo
from commission.app.base.shown_run import RunShown
from commission.app.editing.editor import editor_of
from commission.app.live.actions import FindShiny, MarkSeen, SetThreshold, WatchSensor
from commission.app.live.sensor_panel import said
from commission.app.live.shiny_list import list_text
from commission.app.live.shiny_service import ShinyService
from commission.app.live.state import SensorWatch
from commission.simulation import scenario
from commission.site.reflectors import ReflectorMap
from commission.studies.run import RunInput, judged_run
from commission.studies.start import Start, StartOrigin, belief_at
from tests.app.asking import ME, after
from tests.app.bench import Bench
from tests.app.sites import room


def test_the_list_is_of_the_run_shown_and_of_a_live_drive_as_far_as_it_had_come_when_asked() -> None:
    whole, route = room(), room().routes[0].name
    log, start = scenario.virtual_drive(whole, route, 1), scenario.start_of(whole, route)
    lacking = whole.reflectors.reflectors[1]
    others = tuple(each for each in whole.reflectors.reflectors if each is not lacking)
    project = replace(whole, reflectors=ReflectorMap(others))
    belief = belief_at(log.first_ns, start.pose, start.sigmas.tolist())
    run = judged_run(RunInput.of(project, log, Start(belief, StartOrigin.DRIVE)))

    bench = Bench(ShinyService, project)
    bench.ask(RunShown(run))
    assert bench.found().things is None, "nobody sees the list"
    bench.ask(WatchSensor(seen=True))
    found = bench.found()
    assert not found.outdated
    thing = found.things[0]
    assert (thing.x, thing.y) == pytest.approx((lacking.x, lacking.y), abs=0.05)
    shown = list_text(found, (thing.x, thing.y), is_live=False, inbox="box")
    assert f"<td>{thing.x:.2f}, {thing.y:.2f}</td><td>{thing.scans}</td>" in shown
    assert shown.count("aria-selected=true") == 1
    assert "Look now" not in shown

    bench.ask(RunShown(None))
    assert bench.found() is None, "a vehicle drives now"
    assert "Look now" in list_text(None, None, is_live=True, inbox="box")
    bench.ask(FindShiny(DriveNow(run.inputs, log.last_ns, run.columns)))
    live = bench.found()
    assert [each.text for each in live.things] == [each.text for each in found.things]
    assert live.seconds == pytest.approx((log.last_ns - log.first_ns) * 1e-9)

    marked = after(bench.state, MarkSeen((thing.x, thing.y), others[0].id))
    assert marked.effects == (FlyTo((thing.x, thing.y)),)
    assert marked.state.of_browser(ME, SensorWatch).marked == (thing.x, thing.y)
    assert editor_of(marked.state, ME).selected == (others[0].id,)
    assert editor_of(after(marked.state, MarkSeen((1.0, 1.0), "gone")).state, ME).selected == ()


def test_what_the_script_says_is_checked_before_it_is_done() -> None:
    assert said('{"n": 1, "threshold": 0.4}', None) == SetThreshold(0.4)
    assert said('{"n": 2, "at": [1.5, -2.0], "reflector": "R1"}', None) == MarkSeen((1.5, -2.0), "R1")
    assert said('{"n": 3}', None) == LookAgain()
    for bad in ('{"n": 1, "at": [1e300, 0]}', '{"n": 1, "at": [1]}', '{"n": 1, "what": 2}', "[]"):
        with pytest.raises(ValueError, match="expected"):
            said(bad, None)
