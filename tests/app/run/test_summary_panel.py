"""What the page says of the whole drive: figures and findings of their studies, sections, the colors of the trail."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from commission.app.base.state import AppState
from commission.app.run.actions import ColorTrail
from commission.app.run.found_table import Found
from commission.app.run.state import RunState
from commission.app.run.summary_panel import misplaced_of, rows, summary
from commission.app.run.trail_colors import COLORINGS, TrailBy, palette, pieces, values_of
from commission.app.run.trail_legend import trail_scale
from commission.geometry.arrays import read_only
from commission.localization.estimate import Status
from commission.site.project import Project
from commission.site.stations import Station
from commission.studies.consistency import Recent, consistency
from commission.studies.events import EventsInput, events
from commission.studies.plausibility import Finding
from commission.studies.reflector_figures import ReflectorFiguresInput, reflector_figures
from commission.studies.run import RunResult
from commission.studies.sections import sections
from tests.app.asking import after


def test_no_figure_of_the_accepted_stands_without_those_of_the_rest(result: RunResult) -> None:
    figures = consistency(result.columns)
    shown = dict(rows(figures))
    assert shown["NIS of the accepted / expected"] == f"{figures.nis_mean:.2f} / 1.68"
    assert shown["NIS of all near a reflector / expected"] == f"{figures.nis_before_gate_mean:.2f} / 2"
    assert shown["Rejected"] == f"{100.0 * figures.rejected_fraction:.1f} %"
    assert shown["Cycles without an accepted one"] == f"{100.0 * figures.unseen_fraction:.1f} %"
    assert shown["Longest without"] == f"{figures.longest_unseen:.1f} s"
    nothing = replace(figures, nis_mean=np.nan, nis_before_gate_mean=np.nan, rejected_fraction=np.nan)
    assert dict(rows(nothing))["Rejected"] == "–"


def test_what_looks_wrong_is_said_and_otherwise_that_nothing_does(result: RunResult) -> None:
    assert "Nothing looks wrong" in summary(result, ())
    assert "c-sections" not in summary(result, ())
    columns = result.columns
    status = np.where(columns.status == Status.INLIER, int(Status.OUTLIER_ASSOCIATION), columns.status)
    lost = replace(result, columns=replace(columns, status=read_only(status.astype(np.int8))))
    told = summary(lost, ())
    assert "100 % of the detections are rejected from 0.0 s on" in told
    assert "Nothing looks wrong" not in told


def test_reflectors_that_do_not_stand_as_the_map_says_are_told_once_they_are_found(result: RunResult) -> None:
    misplaced = Finding(found="<R1> by 80 mm", probably="the map is wrong", remedy="survey again")
    told = summary(result, (), (misplaced,))
    assert "&lt;R1&gt; by 80 mm" in told
    assert "the map is wrong" in told
    assert "Nothing looks wrong" not in told
    figures = ReflectorFiguresInput.of(result, None)
    found = Found(events(EventsInput(result)), reflector_figures(figures), (misplaced,))
    assert misplaced_of(found, result) == (misplaced,)
    assert misplaced_of(found, replace(result)) == ()
    assert misplaced_of(None, result) == ()


def test_each_section_between_stations_has_a_row_with_its_figures(result: RunResult) -> None:
    x, y, heading = result.columns.means[len(result.columns) // 2].tolist()
    stations = (Station(name="<Dock>", x=x, y=y, heading=heading),)
    cut = sections(result.columns, stations)
    assert len(cut) > 1
    table = re.findall(r"<tr>(<td.*?)</tr>", summary(result, stations).split("c-sections")[1])
    assert len(table) == len(cut)
    for row, section in zip(table, cut, strict=True):
        cells = re.findall(r"<td[^>]*>(.*?)</td>", row)
        names = [each.replace("<Dock>", "&lt;Dock&gt;") for each in (section.begin, section.end)]
        assert cells[0] == " – ".join(names)
        assert cells[1] == f"{section.figures.nis_before_gate_mean:.2f}"
        assert cells[2] == f"{100.0 * section.figures.rejected_fraction:.1f} %"
        assert cells[3] == f"{100.0 * section.figures.unseen_fraction:.1f} %"
        assert cells[4] == f"{section.figures.longest_unseen:.1f} s"


def test_a_color_of_the_trail_begins_at_the_bound_that_its_legend_names() -> None:
    for by, coloring in COLORINGS.items():
        below, above = (np.array(coloring.bounds) / coloring.scale * factor for factor in (0.999, 1.001))
        assert coloring.classes(below).tolist() == list(range(len(coloring.bounds)))
        assert coloring.classes(above).tolist() == list(range(1, len(coloring.bounds) + 1))
        assert coloring.classes(np.array([np.nan])).tolist() == [len(palette()) - 1]
        for bound in coloring.bounds:
            assert f">{bound:g}<" in trail_scale(by)
    assert trail_scale(TrailBy.NOTHING) == ""


def test_the_trail_is_colored_by_what_was_chosen(project: Project) -> None:
    asked = after(AppState(project=project, saved=project), ColorTrail(TrailBy.NIS)).state
    assert asked.part(RunState).trail_by is TrailBy.NIS
    found = Recent(np.array([1.0, 9.0]), np.array([0.5, 0.02]))
    assert values_of(TrailBy.NIS, found).tolist() == [1.0, 9.0]
    assert values_of(TrailBy.REJECTED, found).tolist() == [0.5, 0.02]


def test_thinning_a_trail_keeps_its_worst_spot_and_hides_none_behind_what_is_unknown() -> None:
    points = np.stack([np.arange(1000.0), np.zeros(1000)], axis=1)
    unknown = len(palette()) - 1
    classes = np.zeros(1000, np.int64)
    classes[500:] = unknown
    classes[502], classes[707] = 4, 2
    lines, found = pieces(points, classes, 100)
    assert len(lines) <= 101
    assert lines[0, 0].tolist() == [0.0, 0.0]
    assert lines[-1, 1].tolist() == [999.0, 0.0]
    assert np.array_equal(lines[1:, 0], lines[:-1, 1])
    assert sorted(set(found.tolist())) == [0, 2, 4, unknown]
    assert len(pieces(points[:1], classes[:1], 100)[0]) == 0
