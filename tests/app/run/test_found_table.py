"""What the lists of events and reflectors hold, what their colors mean, and when they are found again."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
import viser

from commission.app.base.carrier import as_text
from commission.app.base.server import start_server
from commission.app.base.state import AppState
from commission.app.base.view import view_of
from commission.app.run import actions
from commission.app.run.figure_layer import FigureLayer
from commission.app.run.found_table import (
    BY_KEY,
    CLASSES,
    COLUMNS,
    Found,
    bounds_of,
    classes_of,
    message_of,
    palette,
)
from commission.app.run.state import RunState
from commission.site.project import Project
from commission.studies.events import EventsInput, events
from commission.studies.reflector_figures import ReflectorFiguresInput, reflector_figures
from commission.studies.run import RunResult, judged_run
from tests.app.asking import after, joined


@pytest.fixture(scope="module")
def found(project: Project, result: RunResult) -> Found:
    """Of a drive in which reflectors are covered for some seconds."""
    inputs = result.inputs.with_cover(30, covered=True).with_cover(60, covered=False)
    run = judged_run(inputs, earlier=result)
    figures = ReflectorFiguresInput(columns=run.columns, first_ns=run.inputs.log.first_ns, floor_map=project.floor_map)
    return Found(events(EventsInput(run)), reflector_figures(figures))


def test_the_lists_are_those_of_the_studies_in_the_units_of_their_heads(found: Found) -> None:
    sent = json.loads(as_text(message_of(found, "")))
    assert [[time, kind] for time, kind, _ in sent["events"]] == [
        [pytest.approx(event.time, abs=1e-4), event.kind.value] for event in found.events.events
    ]
    assert any("nothing accepted for 3." in figure for _, _, figure in sent["events"])
    titles = [f"{each['title']} [{each['unit']}]" for each in sent["columns"]]
    figures = found.figures
    for number, (name, *values) in enumerate(sent["reflectors"]):
        shown = dict(zip(titles, values, strict=True))
        assert name == figures.names[number]
        assert shown["expected [scans]"] == figures.expected[number]
        expected = int(figures.expected[number])
        share = pytest.approx(100.0 * figures.seen[number] / expected, abs=1e-5) if expected else None
        assert shown["seen [%]"] == share
        for title, values_of in (("along [mm]", figures.along_mean), ("± across [mm]", figures.across_spread)):
            value = values_of[number]
            assert shown[title] == (None if math.isnan(value) else pytest.approx(1000.0 * value, abs=1e-5))
    assert sent["scale"] is None
    assert sent["leftOut"] == 0


def test_the_expected_say_by_what_they_are_expected() -> None:
    assert BY_KEY["expected"].hint.startswith("By the floor map:")
    assert all(column.hint.endswith(".") for column in COLUMNS)
    assert len(BY_KEY) == len(COLUMNS)


def test_colors_go_in_even_steps_from_the_least_to_the_largest_and_grey_is_unknown() -> None:
    values = np.array([0.0, 9.9, 10.1, 60.0, math.nan, 50.1])
    assert bounds_of(values).tolist() == [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0]
    assert classes_of(values).tolist() == [0, 0, 1, 5, CLASSES, 5]
    assert classes_of(np.full(3, math.nan)).tolist() == [CLASSES] * 3
    assert classes_of(np.full(3, 2.0)).max() < CLASSES
    assert len(palette()) == CLASSES + 1 == len(set(palette()))


def test_the_scale_says_what_the_colors_mean(found: Found) -> None:
    scale = message_of(found, "across_mean_mm")["scale"]
    known = 1000.0 * found.figures.across_mean[np.isfinite(found.figures.across_mean)]
    assert scale["title"] == "across [mm]"
    assert float(scale["bounds"][0]) == pytest.approx(known.min(), abs=0.06)
    assert float(scale["bounds"][-1]) == pytest.approx(known.max(), abs=0.06)


@pytest.fixture
def server():
    server = start_server("127.0.0.1", 0)
    yield server
    server.stop()


def test_the_floor_shows_each_reflector_in_the_color_of_its_figure(
    server: viser.ViserServer, project: Project, found: Found
) -> None:
    layer = FigureLayer(server.scene)
    state = AppState(project=project, saved=project)

    def drawn(figure: str) -> dict[tuple[float, float], int]:
        asked = state.with_part(replace(RunState(), figure=figure))
        layer.draw_slowly(view_of(asked, found))
        assert layer.is_used(view_of(asked)) == bool(figure)
        return {
            (round(float(x), 3), round(float(y), 3)): index
            for index, node in enumerate(node for node in layer.nodes() if "_casing" not in node.name)
            for x, y, _ in np.asarray(node.points)
        }

    assert drawn("") == {}
    classes = classes_of(BY_KEY["nis"].values(found.figures))
    assert drawn("nis") == {
        (round(x, 3), round(y, 3)): index
        for (x, y), index in zip(found.figures.places.tolist(), classes.tolist(), strict=True)
    }
    assert drawn("") == {}


def test_a_figure_that_does_not_exist_is_refused(project: Project) -> None:
    state = joined(AppState(project=project, saved=project))
    assert after(state, actions.ColorReflectors("nis")).state.part(RunState).figure == "nis"
    assert after(state, actions.ColorReflectors("")).state.part(RunState).figure == ""
    with pytest.raises(ValueError, match="expected one of expected, seen"):
        after(state, actions.ColorReflectors("weather"))
