"""What is compared of two benchmarks: times and rates under equal labels, the best of all rounds."""

from __future__ import annotations

from tests.benchmarks.before_and_after import Figure, figures, rows

FILTER = "   20 reflectors:  1.412 us/cycle (0.763 s in all), filterpy     886 us/cycle, ratio    627; 98.1 % inliers"
RAYS = "       scans: mean range  12.1 m, cell by cell  0.92 Mrays/s, project  3.50 (all cores  6.10), ratio  3.8"
MOVED = "one reflector moved                         2.70 ms      3.1 ms at most"


def test_times_and_rates_are_found_with_their_units() -> None:
    assert [(f.value, f.unit) for f in figures(FILTER)] == [(1.412, "us/cycle"), (0.763, "s"), (886.0, "us/cycle")]
    assert [(f.value, f.unit) for f in figures(RAYS)] == [(0.92, "Mrays/s")]
    assert [(f.value, f.unit) for f in figures(MOVED)] == [(2.7, "ms"), (3.1, "ms")]
    assert figures("one reflector moved                         2.70 ms")[0].label == "one reflector moved"


def test_label_of_a_figure_does_not_depend_on_those_before_it() -> None:
    for line, changes in (
        (FILTER, {"1.412": "9.9", "0.763": "12.5"}),
        ("541 beams: circle fit 3.46 us/scan, 14.93 on all cores; central beam 1.98 us/scan", {"14.93": "7.1"}),
    ):
        changed = line
        for old, new in changes.items():
            changed = changed.replace(old, new)
        assert [figure.label for figure in figures(line)] == [figure.label for figure in figures(changed)]


def test_ratio_is_above_one_where_it_is_slower_now_whether_time_or_rate() -> None:
    before = [[Figure("drive", 2.0, "ms"), Figure("rays", 4.0, "Mrays/s")]]
    now = [[Figure("drive", 3.0, "ms"), Figure("rays", 2.0, "Mrays/s")]]
    assert list(rows("bench", before, now)) == [
        "| bench | drive | 2 ms | 3 | 1.50 |",
        "| bench | rays | 4 Mrays/s | 2 | 2.00 |",
    ]


def test_best_round_of_each_side_counts() -> None:
    before = [[Figure("drive", 5.0, "ms")], [Figure("drive", 4.0, "ms")]]
    now = [[Figure("drive", 2.0, "ms")], [Figure("drive", 8.0, "ms")]]
    assert list(rows("bench", before, now)) == ["| bench | drive | 4 ms | 2 | 0.50 |"]


def test_what_only_one_side_prints_has_no_ratio() -> None:
    before, now = [[Figure("gone", 1.0, "s")]], [[Figure("new", 2.0, "s")]]
    assert list(rows("bench", before, now)) == ["| bench | new | | 2 s | |", "| bench | gone | 1 s | | |"]
