import csv
import json
import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from commission.errors import FileFormatError
from commission.io.results import write_results
from commission.localization.estimate import Belief, Mode, Status
from commission.localization.run_columns import RunSegment
from commission.localization.setup import LocalizerSetup
from commission.localization.whole_run import run, run_segments
from commission.site.parameters import Parameters, SupervisorParameters
from commission.site.record_log import RecordLog
from commission.site.records import Detections, Odometry, Scan
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner

IDS = ('North, "old"', "süd", "3")
CENTERS = ((4.0, 1.0), (5.0, -2.0), (1.0, 3.0))
REFLECTORS = ReflectorMap(tuple(Reflector(id=name, x=x, y=y) for name, (x, y) in zip(IDS, CENTERS, strict=True)))


def seen_from(x):
    return [(math.hypot(cx - x, cy), math.atan2(cy, cx - x)) for cx, cy in CENTERS]


def drive():
    """Three cycles: all reflectors, none, all and one thing that is no reflector."""
    return [
        Odometry(0, np.zeros(3)),
        Detections(0, seen_from(0.0)),
        Odometry(100, [0.1, 0.0, 0.0]),
        Detections(100, np.empty((0, 2))),
        Odometry(200, [0.1, 0.0, 0.0]),
        Detections(200, [*seen_from(0.2), (9.0, 2.5)]),
    ]


def run_over(records, **groups):
    setup = LocalizerSetup(reflectors=REFLECTORS, scanners=(Scanner(),), parameters=Parameters(**groups))
    return run(RecordLog.collect(records), setup, Belief(0, np.zeros(3), 1e-4 * np.eye(3)))


def rows(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_each_segment_names_the_reflectors_of_its_own_map(tmp_path):
    renamed = ReflectorMap(tuple(replace(r, id=f"new {i}") for i, r in enumerate(REFLECTORS.reflectors)))
    segments = tuple(
        RunSegment(first, LocalizerSetup(reflectors=reflectors, scanners=(Scanner(),), parameters=Parameters()))
        for first, reflectors in enumerate((REFLECTORS, REFLECTORS, renamed))
    )
    start = Belief(0, np.zeros(3), 1e-4 * np.eye(3))
    write_results(tmp_path, run_segments(RecordLog.collect(drive()), segments, start), {})
    found = [(row["stamp_ns"], row["reflector_id"]) for row in rows(tmp_path / "detections.csv")]
    assert [name for stamp, name in found if stamp == "0"] == list(IDS)
    assert [name for stamp, name in found if stamp == "200"][:3] == ["new 0", "new 1", "new 2"]


def test_every_cycle_is_a_row_that_reads_back_to_the_last_bit(tmp_path):
    arrays = run_over(drive())
    write_results(tmp_path, arrays, {})
    table = rows(tmp_path / "estimates.csv")
    assert [int(row["stamp_ns"]) for row in table] == [0, 100, 200]
    assert [[float(row[c]) for c in ("x", "y", "theta")] for row in table] == arrays.means.tolist()
    upper = [
        [float(row[c]) for c in ("var_x", "cov_xy", "cov_xtheta", "var_y", "cov_ytheta", "var_theta")] for row in table
    ]
    assert upper == arrays.covariances.reshape(-1, 9)[:, [0, 1, 2, 4, 5, 8]].tolist()
    assert [(row["inliers"], row["outliers"]) for row in table] == [("3", "0"), ("0", "0"), ("3", "1")]


def test_every_detection_is_a_row_with_its_place_on_the_floor_and_its_reflector(tmp_path):
    arrays = run_over(drive())
    write_results(tmp_path, arrays, {})
    table = rows(tmp_path / "detections.csv")
    assert [int(row["stamp_ns"]) for row in table] == [0, 0, 0, 200, 200, 200, 200]
    assert [row["reflector_id"] for row in table[:6]] == [*IDS, *IDS]
    # Exact measurements: each detection lies where its reflector is.
    assert_allclose([(float(row["x"]), float(row["y"])) for row in table[:3]], CENTERS, atol=1e-9)
    assert [row["status"] for row in table] == ["inlier"] * 6 + ["outlier_association"]
    assert [float(row["d2"]) for row in table[:6]] == arrays.d2[:6].tolist()


def test_a_rejected_cluster_names_no_reflector_and_no_distance(tmp_path):
    flags = np.zeros(40, dtype=np.bool_)
    flags[10:30] = True
    scan = Scan(
        stamp_ns=0,
        ranges=np.full(40, 3.0, dtype=np.float32),
        angle_min=-0.1,
        angle_increment=0.005,
        intensities=None,
        reflector=flags,
    )
    arrays = run_over([Odometry(0, np.zeros(3)), scan])
    assert arrays.status.tolist() == [Status.OUTLIER_DETECTOR]
    write_results(tmp_path, arrays, {})
    row = rows(tmp_path / "detections.csv")[0]
    assert (row["status"], row["reflector_id"], row["d2"]) == ("outlier_detector", "", "")


def test_the_filter_s_own_state_goes_on_in_fail_mode(tmp_path):
    arrays = run_over(drive(), supervisor=SupervisorParameters(position_limit=1e-6))
    assert arrays.modes.tolist() == [Mode.FAIL] * 3
    write_results(tmp_path, arrays, {})
    table = rows(tmp_path / "estimates.csv")
    assert {row["mode"] for row in table} == {"fail"}
    assert float(table[-1]["x"]) == pytest.approx(0.2, abs=0.02)


def test_the_summary_is_json_in_the_order_given(tmp_path):
    entries = {"cycles": 3, "nis_mean": None, "duration_s": 0.2}
    write_results(tmp_path, run_over(drive()), entries)
    assert list(json.loads((tmp_path / "summary.json").read_text(encoding="utf-8")).items()) == list(entries.items())


def test_a_run_longer_than_one_block_is_written_whole(tmp_path, monkeypatch):
    monkeypatch.setattr("commission.io.results.ROWS_AT_ONCE", 2)
    write_results(tmp_path, run_over(drive()), {})
    assert len(rows(tmp_path / "estimates.csv")) == 3
    assert len(rows(tmp_path / "detections.csv")) == 7


def test_results_are_replaced_and_no_temporary_file_stays(tmp_path):
    for _ in range(2):
        write_results(tmp_path, run_over(drive()), {})
    assert sorted(path.name for path in tmp_path.iterdir()) == ["detections.csv", "estimates.csv", "summary.json"]


def test_a_folder_that_is_a_file_is_an_error_that_names_it(tmp_path):
    (tmp_path / "out").write_text("", encoding="utf-8")
    with pytest.raises(FileFormatError, match="out"):
        write_results(tmp_path / "out", run_over(drive()), {})
