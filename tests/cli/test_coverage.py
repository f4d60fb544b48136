"""The command `coverage`."""

import dataclasses
import json
import re

import numpy as np
import pytest

from commission.io.project_file import load_project, save_project
from commission.site.disturbances import Reel
from tests.conftest import REPOSITORY


def summary(folder):
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))


def test_coverage_writes_its_files_and_tells_what_it_found(commission, project, tmp_path):
    code, told, err = commission("coverage", project, "--out", tmp_path / "out", "--spacing", "0.5")
    assert (code, err) == (0, "")
    assert "5 reflectors" in told
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        *(".commission.result", "coverage.csv", "coverage.npz", "coverage.png", "summary.json")
    ]
    entries = summary(tmp_path / "out")
    assert entries["spacing_m"] == 0.5
    assert 0.5 < entries["share_with_fix"] <= 1.0


@pytest.mark.parametrize("heading", ["all-round", "worst", "best", "30"])
def test_ellipses_are_as_long_as_the_position_error_of_their_points(commission, project, tmp_path, heading):
    words = ("--ellipses", "1.2", "--spacing", "0.5", "--heading", heading)
    assert commission("coverage", project, "--out", tmp_path / "out", *words)[0] == 0
    x, y, major, minor, angle = np.loadtxt(tmp_path / "out" / "ellipses.csv", delimiter=",", skiprows=1).T
    with np.load(tmp_path / "out" / "coverage.npz") as found:
        column, row = np.searchsorted(found["x"], x - 0.01), np.searchsorted(found["y"], y - 0.01)
        assert major == pytest.approx(found["position_sigma_m"][row, column], rel=1e-5)
    assert np.diff(np.unique(x)).min() == pytest.approx(1.5)
    assert (minor <= major).all()
    assert (np.abs(angle) <= np.pi / 2).all()


def test_triangulation_is_worse_than_ranges_and_a_prior_is_better(commission, project, tmp_path):
    for name in ("range-bearing", "bearing-only", "range-bearing-prior"):
        assert commission("coverage", project, "--out", tmp_path / name, "--measurement", name)[0] == 0
    names = ("bearing-only", "range-bearing", "range-bearing-prior")
    triangulated, ranged, prepared = (summary(tmp_path / name)["position_sigma_median_m"] for name in names)
    assert triangulated > ranged > prepared


@pytest.mark.parametrize("heading", ["worst", "best", "90"])
def test_headings_are_words_or_degrees(commission, project, tmp_path, heading):
    # The project's scanner sees a full turn, so every heading sees the same; only base and scanner are 0.2 m apart.
    assert commission("coverage", project, "--out", tmp_path / "out", "--heading", heading)[0] == 0
    assert commission("coverage", project, "--out", tmp_path / "all")[0] == 0
    with np.load(tmp_path / "out" / "coverage.npz") as one, np.load(tmp_path / "all" / "coverage.npz") as other:
        same = np.array_equal(one["position_sigma_m"], other["position_sigma_m"])
    assert same == (heading != "90")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--spacing", "0"), "spacing is 0"),
        (("--heading", "north"), "heading"),
        (("--blocked-per-m", "2"), "blocked_per_m"),
        (("--min-beams", "0"), "min_beams"),
        (("--odometry", "-1"), "odometry"),
        (("--ellipses", "0"), "--ellipses is 0.0; expected metres greater than 0"),
        (("--measurement", "guess"), "measurement"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_what_cannot_be_computed_is_one_line_and_exit_code_2(commission, project, tmp_path, words, said):
    code, told, err = commission("coverage", project, "--out", tmp_path / "out", *words)
    assert (code, told) == (2, "")
    assert said in err
    assert err.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("view", "heading"), [("[-180.0, 180.0]", "all-round"), ("[-135.0, 135.0]", "worst")])
def test_unasked_it_is_the_worst_heading_where_the_scanner_does_not_see_all_around(
    commission, project, tmp_path, view, heading
):
    text = (project / "project.yaml").read_text(encoding="utf-8")
    changed = re.sub(r"field_of_view_deg: \[[^\]]*\]", f"field_of_view_deg: {view}", text)
    assert "field_of_view_deg" in changed
    (project / "project.yaml").write_text(changed, encoding="utf-8")
    _, told, _ = commission("coverage", project, "--out", tmp_path / "out", "--spacing", "0.5")
    assert ("Heading      worst of 16" in told) is (heading == "worst")
    commission("coverage", project, "--out", tmp_path / "said", "--spacing", "0.5", "--heading", heading)
    assert summary(tmp_path / "out") == summary(tmp_path / "said")


def test_the_budget_of_the_floor_is_written_and_told(commission, project, tmp_path):
    code, told, _ = commission("coverage", project, "--out", tmp_path / "out", "--spacing", "0.5", "--budget")
    assert code == 0
    with np.load(tmp_path / "out" / "coverage.npz") as found:
        has_fix = np.isfinite(found["total_sigma_m"]) & found["drivable"]
        assert (found["total_sigma_m"][has_fix] > found["position_sigma_m"][has_fix]).all()
        shares = np.stack([found[f"{part}_share"] for part in ("noise", "map", "mounting", "range", "clock")])
    np.testing.assert_allclose(shares.sum(axis=0)[has_fix], 1.0)
    entries = summary(tmp_path / "out")
    largest = [entries[f"share_{part}_largest"] for part in ("noise", "map", "mounting", "range", "clock")]
    assert sum(largest) <= 1.0 + 1e-12
    assert f"position {1000.0 * entries['total_sigma_median_m']:.1f} mm median" in told
    assert f"clock on {100.0 * largest[4]:.1f} %" in told


def test_what_contours_tell_is_written_and_told(commission, tmp_path):
    site = REPOSITORY / "maps" / "laboratory"
    code, told, err = commission("coverage", site, "--out", tmp_path / "out", "--spacing", "0.5", "--contours")
    assert (code, err) == (0, "")
    entries = summary(tmp_path / "out")
    with np.load(tmp_path / "out" / "coverage.npz") as found:
        on = found["drivable"]
        whole = found["contour_told"][on] == 3
        sigma, turned = found["contour_position_sigma_m"][on], found["contour_heading_sigma_rad"][on]
        reflectors = 2.0 * found["position_sigma_m"][on], 2.0 * found["heading_sigma_rad"][on]
    assert np.isfinite(sigma).tolist() == whole.tolist()
    # The supervisor's limits by default: 0.1 m and 3 degrees.
    within = (2.0 * sigma <= 0.1) & (2.0 * turned <= np.radians(3.0))
    either = within | ((reflectors[0] <= 0.1) & (reflectors[1] <= np.radians(3.0)))
    assert entries["contour_share_whole_pose"] == pytest.approx(whole.mean())
    assert entries["contour_share_within_limits"] == pytest.approx(within.mean())
    assert entries["share_within_limits_by_either"] == pytest.approx(either.mean())
    assert f"tell the whole pose on {100.0 * whole.mean():.1f} %" in told


def test_contours_without_a_floor_map_are_one_clear_error(commission, project, tmp_path):
    code, _, err = commission("coverage", project, "--out", tmp_path / "out", "--contours")
    assert code == 2
    assert "has no floor map; --contours expects one" in err


def test_what_tags_tell_is_written_and_told(commission, tmp_path):
    site = REPOSITORY / "maps" / "assembly"
    options = ("--spacing", "0.5", "--heading", "best", "--tags")
    code, told, err = commission("coverage", site, "--out", tmp_path / "out", *options)
    assert (code, err) == (0, "")
    entries = summary(tmp_path / "out")
    with np.load(tmp_path / "out" / "coverage.npz") as found:
        on = found["drivable"]
        seen, sigma = found["tags_seen"][on] > 0, found["tag_position_sigma_m"][on]
    assert np.isfinite(sigma).tolist() == seen.tolist()
    assert 0.5 < entries["tag_share_seen"] == pytest.approx(seen.mean())
    assert f"Tags         one is in sight on {100.0 * seen.mean():.1f} %" in told
    code, _, err = commission("coverage", REPOSITORY / "maps" / "laboratory", "--out", tmp_path / "none", "--tags")
    assert code == 2
    assert "has no tags; --tags expects some under tags:" in err


def test_how_many_temporary_landmarks_are_in_sight_is_written_and_told(commission, tmp_path):
    site = load_project(REPOSITORY / "maps" / "laboratory")
    reels = (Reel(x=3.0, y=3.0, radius=0.4), Reel(x=6.0, y=3.0, radius=0.4))
    stocked = dataclasses.replace(site, disturbances=dataclasses.replace(site.disturbances, reels=reels))
    save_project(stocked, tmp_path / "stocked")
    options = ("--spacing", "0.25", "--temporary")
    code, told, err = commission("coverage", tmp_path / "stocked", "--out", tmp_path / "out", *options)
    assert (code, err) == (0, "")
    entries = summary(tmp_path / "out")
    with np.load(tmp_path / "out" / "coverage.npz") as found:
        seen = found["reels_seen"][found["drivable"]]
    assert 0.0 < (seen > 1).mean() < (seen > 0).mean() < 1.0
    assert entries["reel_share_seen"] == pytest.approx((seen > 0).mean())
    assert entries["reel_share_two_seen"] == pytest.approx((seen > 1).mean())
    assert f"Temporary    a reel is in sight on {100.0 * (seen > 0).mean():.1f} %" in told
    code, _, err = commission("coverage", REPOSITORY / "maps" / "laboratory", "--out", tmp_path / "none", "--temporary")
    assert code == 2
    assert "has no reels; --temporary expects some under disturbances:" in err
