"""Tags as an observation kind: rows, gate, considered errors, whose it is, a lost vehicle told by one, live = whole."""

# pyright: basic

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest

from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.localization.consider import ConsiderModel
from commission.localization.estimate import Belief, Mode
from commission.localization.growing_run import GrowingRun
from commission.localization.pose_gaussian import covariance_of, from_belief, mean_of
from commission.localization.run_columns import RunSegment
from commission.localization.search_map import anywhere
from commission.localization.setup import LocalizerSetup
from commission.localization.state import state_unlocated
from commission.localization.tag_start import told_by_tags
from commission.localization.tags import (
    COLUMNS,
    ENTRY,
    NIS,
    NOT_ON_SITE,
    NOT_READ,
    PER_CAMERA,
    PER_TAG,
    USE,
    TagUse,
    correct_by_tag,
    entries_of,
    tag_model,
    tag_rows,
)
from commission.localization.whole_run import run, run_segments, state_before
from commission.site.parameters import TagParameters
from commission.site.record_log import RecordLog
from commission.site.records import Detections, Odometry, TagSightings
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from commission.site.tags import Tag, TagCamera
from tests.around_a_tag import SITE, motion, recorded, setup_of

TAGS = (Tag(id="7", x=3.0, y=1.0, heading=2.0, sigma=0.004, heading_sigma=0.002), Tag(id="8", x=-2.0, y=4.0))
CAMERA = TagCamera(mounting=np.array((0.3, -0.1, 0.7)))
MODEL = tag_model(TAGS, CAMERA, TagParameters(), 4)
KNOWN = ConsiderModel(0.002**2, 0.001**2, 0.0, 0.005**2)
UNKNOWN = ConsiderModel(0.0, 0.0, 0.0, 0.0)
TWIST = (0.4, -0.2, 0.3)
POSE, SIGMAS = np.array((0.5, -0.4, 0.3)), np.array((0.05, 0.04, 0.02))


def belief_at(pose, covariance):
    return from_belief(Belief(0, np.array(pose, dtype=np.float64), covariance))


def expected(pose, mounting, tag):
    """Where the camera measures a tag, by composing poses: no formula of `tags` is in it."""
    return se2.relative(se2.compose(np.asarray(pose), np.asarray(mounting)), np.asarray(tag))


def sighting_of(measured, sigmas=(math.nan, math.nan, math.nan)):
    return np.array((*measured, *sigmas), dtype=np.float64)


def seen_from(pose, tag=TAGS[0], off=(0.0, 0.0, 0.0)):
    return sighting_of(expected(pose, CAMERA.mounting, tag.pose) + off)


def corrected(belief, sighting, entry, *, model=MODEL, known=UNKNOWN, cross=None, invariant=False):
    figures, busy = np.zeros(6), None if cross is None else np.zeros(1, np.int64)
    after = correct_by_tag(belief, sighting, entry, model, TWIST, known, cross, busy, figures, invariant)
    return after, figures


def test_jacobians_of_pose_and_constants_are_finite_differences():
    rng = np.random.default_rng(0)
    for _ in range(20):
        pose, tag = rng.uniform(-3.0, 3.0, 3), rng.uniform(-3.0, 3.0, 3)
        mounting = rng.uniform(-1.0, 1.0, 3)
        model = tag_model(TAGS, TagCamera(mounting=mounting), TagParameters(), 0)
        sighting = sighting_of(expected(pose, mounting, tag), (0.01, 0.02, 0.03))
        rows = tag_rows(belief_at(pose, np.eye(3)), sighting, tag, model, TWIST)
        assert rows.residuals == pytest.approx(np.zeros(3), abs=1e-12)
        assert rows.variances == pytest.approx(np.square((0.01, 0.02, 0.03)))

        def of(x, m=mounting, where=tag):
            return expected(x, m, where)

        def off(of, at, step=1e-6):
            steps = step * np.eye(3)
            both = [(of(at + each), of(at - each)) for each in steps]
            return np.array([np.append((a - b)[:2], wrap(a[2] - b[2])) / (2.0 * step) for a, b in both]).T

        H = off(of, pose)
        assert rows.jacobians == pytest.approx(H, abs=1e-7)
        assert rows.constants[:, :3] == pytest.approx(
            off(lambda m, x=pose, t=tag: expected(x, m, t), mounting), abs=1e-7
        )
        assert rows.constants[:, PER_CAMERA:] == pytest.approx(
            off(lambda t, x=pose, m=mounting: expected(x, m, t), tag), abs=1e-7
        )
        # A clock that is late by a second: the tag was measured where the vehicle was a second ago.
        before = expected(se2.compose(pose, se2.exp(-1e-6 * np.array(TWIST))), mounting, tag)
        change = before - expected(pose, mounting, tag)
        assert rows.constants[:, 3] == pytest.approx(np.append(change[:2], wrap(change[2])) / 1e-6, abs=1e-4)


def test_a_sighting_corrects_like_equations_21_to_23():
    rng = np.random.default_rng(1)
    for _ in range(30):
        root = rng.standard_normal((3, 3)) * SIGMAS
        P = root @ root.T + 1e-6 * np.eye(3)
        sighting = sighting_of(
            expected(POSE, CAMERA.mounting, TAGS[0].pose) + rng.normal(0.0, 0.01, 3), (0.02, 0.03, 0.01)
        )
        belief = belief_at(POSE, P)
        rows = tag_rows(belief, sighting, MODEL.places[0], MODEL, TWIST)
        H, R = rows.jacobians, np.diag((0.02**2, 0.03**2, 0.01**2))
        # The place of the tag counts as noise where it is not considered.
        S = H @ P @ H.T + R + rows.constants[:, 4:] @ np.diag((0.004**2, 0.004**2, 0.002**2)) @ rows.constants[:, 4:].T
        after, figures = corrected(belief, sighting, 0)
        v = rows.residuals
        assert figures[NIS] == pytest.approx(v @ np.linalg.solve(S, v), rel=1e-9)
        exact = tag_model(
            tuple(dataclasses.replace(tag, sigma=0.0, heading_sigma=0.0) for tag in TAGS), CAMERA, TagParameters(), 4
        )
        after, _ = corrected(belief, sighting, 0, model=exact)
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
        assert mean_of(after) == pytest.approx(POSE + K @ v, abs=1e-12)
        assert covariance_of(after) == pytest.approx((np.eye(3) - K @ H) @ P, abs=1e-12)


def test_considered_constants_correct_like_schmidts_filter_of_the_whole_state():
    rng = np.random.default_rng(2)
    columns = 4 + PER_CAMERA + 2 * PER_TAG
    seen = [4, 5, 6, 7, 8 + PER_TAG, 9 + PER_TAG, 10 + PER_TAG]
    for _ in range(20):
        root = rng.standard_normal((3, 3)) * SIGMAS
        P, cross = root @ root.T + 1e-3 * np.eye(3), rng.normal(0.0, 1e-5, (3, columns))
        variances = np.array((2e-6, 2e-6, 1e-6, 2.5e-5, 9e-6, 9e-6, 9e-6))
        belief, sighting = belief_at(POSE, P), seen_from(POSE, TAGS[1], rng.normal(0.0, 0.01, 3))
        known = ConsiderModel(2e-6, 1e-6, 0.0, 2.5e-5)
        model = MODEL._replace(survey=np.full((2, 2), 9e-6))
        rows = tag_rows(belief, sighting, model.places[1], model, TWIST)
        H, J, R = rows.jacobians, rows.constants, np.diag(rows.variances)
        C = cross[:, seen].copy()
        S = H @ P @ H.T + H @ C @ J.T + (H @ C @ J.T).T + J @ np.diag(variances) @ J.T + R
        written, figures = cross.copy(), np.zeros(6)
        after = correct_by_tag(belief, sighting, 1, model, TWIST, known, written, np.full(1, 50), figures, False)
        assert figures[NIS] == pytest.approx(rows.residuals @ np.linalg.solve(S, rows.residuals), rel=1e-9)
        # Row by row, of the state with all its constants, whose gains are put to zero.
        whole, mean = np.zeros((3 + columns, 3 + columns)), np.zeros(3 + columns)
        whole[:3, :3], whole[:3, 3:], whole[3:, :3] = P, cross, cross.T
        whole[np.add(seen, 3), np.add(seen, 3)] = variances
        for k in range(3):
            row = np.zeros(3 + columns)
            row[:3], row[np.add(seen, 3)] = H[k], J[k]
            gain = whole @ row / (row @ whole @ row + R[k, k])
            gain[3:] = 0.0
            mean += gain * (rows.residuals[k] - row @ mean)
            joseph = np.eye(3 + columns) - np.outer(gain, row)
            whole = joseph @ whole @ joseph.T + R[k, k] * np.outer(gain, gain)
        assert mean_of(after) == pytest.approx(POSE + mean[:3], abs=1e-11)
        assert covariance_of(after) == pytest.approx(whole[:3, :3], abs=1e-11)
        assert written == pytest.approx(whole[:3, 3:], abs=1e-11)


@pytest.mark.parametrize("invariant", [False, True])
def test_in_a_hall_that_is_moved_and_turned_the_same_comes_out_moved_and_turned(invariant):
    moved = np.array((40.0, -25.0, 2.2))
    places = np.array([se2.compose(moved, place) for place in MODEL.places])
    turned = MODEL._replace(places=places)
    root = np.array(((0.05, 0.0, 0.0), (0.01, 0.04, 0.0), (0.004, -0.002, 0.02)))
    c, s = math.cos(moved[2]), math.sin(moved[2])
    turn = np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))
    P, sighting = root @ root.T, seen_from(POSE, off=(0.03, -0.02, 0.01))
    here, there = (
        corrected(belief_at(POSE, P), sighting, 0, known=KNOWN, invariant=invariant),
        corrected(
            belief_at(se2.compose(moved, POSE), turn @ P @ turn.T),
            sighting,
            0,
            model=turned,
            known=KNOWN,
            invariant=invariant,
        ),
    )
    assert there[1] == pytest.approx(here[1], rel=1e-9)
    assert se2.relative(moved, mean_of(there[0])) == pytest.approx(mean_of(here[0]), abs=1e-12)
    assert turn.T @ covariance_of(there[0]) @ turn == pytest.approx(covariance_of(here[0]), abs=1e-12)


def test_the_gate_has_three_degrees_of_freedom():
    # 16.266 is the 0.999 quantile of chi-square with three degrees of freedom (any table).
    belief, exact = belief_at(POSE, 1e-16 * np.eye(3)), MODEL._replace(survey=np.zeros((2, 2)))
    for factor, use in ((0.999, TagUse.ACCEPTED), (1.001, TagUse.REJECTED)):
        off = factor * 0.02 * math.sqrt(16.266 / 3.0) * np.ones(3)
        after, figures = corrected(belief, seen_from(POSE, off=off), 0, model=exact)
        assert figures[USE] == use
        assert (after == belief) is (use == TagUse.REJECTED)


def test_a_tag_at_the_camera_and_one_exactly_behind_it_correct_without_a_number_that_is_none():
    for tag in ((0.0, 0.0, 0.0), (-1.0, 0.0, math.pi)):
        place = se2.compose(se2.compose(POSE, CAMERA.mounting), np.array(tag))
        model = MODEL._replace(places=np.array([place]), survey=np.zeros((1, 2)))
        after, figures = corrected(belief_at(POSE, np.diag(np.square(SIGMAS))), sighting_of(tag), 0, model=model)
        assert figures[USE] == TagUse.ACCEPTED
        assert mean_of(after) == pytest.approx(POSE, abs=1e-9)
        assert np.linalg.eigvalsh(covariance_of(after)).min() > 0.0


def test_a_sighting_without_an_id_is_of_the_only_tag_that_fits():
    belief = belief_at(POSE, np.diag(np.square(SIGMAS)))
    _, figures = corrected(belief, seen_from(POSE, TAGS[1]), NOT_READ)
    assert (figures[USE], figures[ENTRY]) == (TagUse.ACCEPTED, 1)
    twice = MODEL._replace(places=np.stack((MODEL.places[0], MODEL.places[0] + 0.01)))
    after, figures = corrected(belief, seen_from(POSE), NOT_READ, model=twice)
    assert (figures[USE], figures[ENTRY], after == belief) == (TagUse.UNKNOWN, -1, True)
    for entry, sighting in ((NOT_READ, seen_from(POSE, off=(1.0, 0.0, 0.0))), (NOT_ON_SITE, seen_from(POSE))):
        after, figures = corrected(belief, sighting, entry)
        assert (figures[USE], after == belief) == (TagUse.UNKNOWN, True)
    named = (TAGS[0], dataclasses.replace(TAGS[1], anonymous=True))
    assert entries_of(np.array(["7", "8", "9", ""]), named).tolist() == [0, NOT_ON_SITE, NOT_ON_SITE, NOT_READ]


def mixed(seed=0):
    """A vehicle that stands, with detections of its sensor, named, anonymous and foreign tags, and empty frames."""
    rng, records = np.random.default_rng(seed), []
    for k in range(150):
        stamp = k * 100_000_000
        records.append(Odometry(stamp, np.zeros(3)))
        if k % 3 == 0:
            measured = np.array((2.0, 0.0, 0.5)) + rng.normal(0.0, 0.02, 3)
            ids = (("7",), ("",), ("9",), ())[k // 3 % 4]
            rows = np.array([sighting_of(measured, (0.02, 0.02, math.nan))] * len(ids)).reshape(-1, 6)
            records.append(TagSightings(stamp + 7 * (k % 2), rows, ids))
        if k % 5 == 2:
            seen = np.array([(math.hypot(3.0, 1.0), math.atan2(1.0, 3.0))]) + rng.normal(0.0, 0.003, (1, 2))
            records.append(Detections(stamp, seen))
    return RecordLog.collect(records)


STANDING = LocalizerSetup(
    reflectors=ReflectorMap((Reflector(id="A", x=3.0, y=1.0),)),
    scanners=(Scanner(),),
    parameters=SITE.parameters,
    tags=(Tag(id="7", x=2.0, y=0.0, heading=0.5), Tag(id="8", x=2.0, y=9.0)),
)
NEAR = Belief(0, np.array((0.01, 0.0, 0.0)), 0.01 * np.eye(3))


def grown(log, setup, start):
    live = GrowingRun(setup, start)
    for record in log.records():
        live.feed(record)
    live.flush()
    return live.columns()


def assert_the_same(whole, live):
    assert whole.stamps_ns.tolist() == live.stamps_ns.tolist()
    for name in ("means", "covariances", "modes", "tags", "d2", "status"):
        assert getattr(whole, name).tobytes() == getattr(live, name).tobytes(), name
    for name in ("is_frame", "offsets", "sightings", "numbers"):
        assert getattr(whole.detected.tags, name).tobytes() == getattr(live.detected.tags, name).tobytes(), name
    assert whole.detected.tags.ids.tolist() == live.detected.tags.ids.tolist()
    assert whole.final == live.final
    for cycle in range(0, len(whole), 7):
        a, b = whole.estimate(cycle), live.estimate(cycle)
        assert (a.tags is None) == (b.tags is None)
        assert a.prior.covariance.tobytes() == b.prior.covariance.tobytes()


@pytest.mark.parametrize("consider", [True, False])
def test_live_is_the_whole_run_to_the_last_bit(consider):
    filtering = dataclasses.replace(STANDING.parameters.filter, consider=consider)
    setup = dataclasses.replace(STANDING, parameters=dataclasses.replace(STANDING.parameters, filter=filtering))
    log = mixed()
    whole = run(log, setup, NEAR)
    assert_the_same(whole, grown(log, setup, NEAR))
    frames = whole.detected.tags.is_frame
    assert frames.sum() == len(log.tags) == 50
    assert np.bincount(whole.tags[:, USE].astype(int)).tolist() == [0, 26, 0, 12]
    # Through a checkpoint in the middle, and with a setup that looks at no tags from there on.
    assert state_before(whole, log, 41).tracking.belief == from_belief(whole.estimate(40).posterior)
    blind = dataclasses.replace(setup.parameters, tag=TagParameters(enabled=False))
    segments = (RunSegment(0, setup), RunSegment(40, dataclasses.replace(setup, parameters=blind)))
    cut = run_segments(log, segments, NEAR)
    again = run_segments(log, segments, NEAR, earlier=run_segments(log, segments[:1], NEAR))
    assert cut.means[:40].tobytes() == whole.means[:40].tobytes()
    assert cut.means.tobytes() == again.means.tobytes()
    assert cut.tags.tobytes() == again.tags.tobytes()
    assert not cut.tags[whole.detected.tags.offsets[40] :].any()


def test_a_vehicle_that_is_not_told_where_it_is_is_told_by_one_tag():
    log = mixed()
    start = state_unlocated(0, anywhere(STANDING.index.places))
    whole = run(log, STANDING, start)
    assert_the_same(whole, grown(log, STANDING, start))
    assert whole.modes[0] == Mode.FAIL
    assert whole.tags[0, USE] == TagUse.LOCATED
    assert np.hypot(*whole.means[0, :2]) < 0.1
    # It says so only once others agree.
    assert whole.modes[-1] == Mode.OPERATIONAL
    assert int(np.argmax(whole.modes == Mode.OPERATIONAL)) >= 5


def test_what_a_frame_believed_by_itself_is_not_handed_out_once_a_tag_tells_another_place():
    frame = next(each for each in mixed().records() if isinstance(each, TagSightings) and len(each.ids))
    lost = state_unlocated(0, anywhere(STANDING.index.places))
    elsewhere = from_belief(Belief(0, np.array((7.0, -3.0, 1.0)), 1e-4 * np.eye(3)))
    wrong = lost.tracking._replace(belief=elsewhere, output=elsewhere, output_ns=5, mode=int(Mode.OPERATIONAL))
    believed = lost._replace(tracking=wrong)
    figures = np.zeros((len(frame.ids), COLUMNS))
    told = told_by_tags((lost, believed), STANDING, frame.sightings, np.array(frame.ids, dtype=np.str_), figures)
    assert told is not None
    before, after = lost.tracking, told.tracking
    assert (after.output, after.output_ns, after.mode) == (before.output, before.output_ns, Mode.FAIL)
    assert math.dist((after.belief.x, after.belief.y), (7.0, -3.0)) > 1.0


def test_a_place_told_by_a_tag_is_as_uncertain_as_many_such_places_scatter():
    site = dataclasses.replace(SITE, tags=(dataclasses.replace(SITE.tags[0], sigma=0.02, heading_sigma=0.01),))
    setup, nees = setup_of(site), []
    true = motion("circle", 1)
    for seed in range(40):
        log = recorded(true, seed, site)
        some = RecordLog.collect(itertools.islice(log.records(), 40))
        columns = run(some, setup, state_unlocated(0, anywhere(np.empty((0, 2)))))
        error = columns.means[:2] - some.reference_poses[:2]
        error[:, 2] = wrap(error[:, 2])
        nees += [row @ np.linalg.solve(P, row) for row, P in zip(error, columns.covariances, strict=False)]
    # Chi-square with 120 degrees of freedom, of which the second cycle shares the constants: within 40 % in 99 of 100.
    assert 0.65 < np.mean(nees) / 3.0 < 1.4, np.mean(nees) / 3.0
