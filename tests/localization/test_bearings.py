"""Bearings alone as an observation kind: rows, gate, considered errors, whose they are, live = whole, lost again."""

# pyright: basic

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy.stats import chi2

from commission.geometry import se2
from commission.geometry.angles import wrap
from commission.localization.bearings import (
    CONSTANTS,
    NIS,
    NOT_IN_MAP,
    NOT_NAMED,
    REFLECTOR,
    USE,
    BearingUse,
    bearing_model,
    bearing_rows,
    correct_by_bearing_alone,
    entries_named,
)
from commission.localization.consider import ConsiderModel
from commission.localization.estimate import Belief, Mode
from commission.localization.growing_run import GrowingRun
from commission.localization.observation import observation_model
from commission.localization.pose_gaussian import covariance_of, from_belief, mean_of
from commission.localization.run_columns import RunSegment
from commission.localization.search_map import anywhere
from commission.localization.setup import LocalizerSetup
from commission.localization.state import state_unlocated
from commission.localization.whole_run import run, run_segments, state_before
from commission.site.parameters import BearingParameters, ObservationParameters, OdometryParameters, Parameters
from commission.site.project import Project
from commission.site.record_log import RecordLog
from commission.site.records import Detections, Odometry, Reflex, TagSightings
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner, ScannerKind
from commission.site.tags import Tag
from commission.site.uncertainty import Uncertainty
from commission.studies.bearing_figures import bearing_findings
from commission.studies.events import EventKind, EventsInput, events, told
from commission.studies.run import RunInput, judged_run
from commission.studies.start import Start, StartOrigin
from tests.conftest import REPOSITORY, few_of

GONIOMETER = Scanner(
    name="goniometer",
    kind=ScannerKind.GONIOMETER,
    mounting=np.array((0.3, -0.1, 0.7)),
    field_of_view_deg=(-180.0, 180.0),
    bearing_sigma_deg=0.05,
)
PLACES = np.array(((3.0, 1.0, 1.6e-5, 1.0), (-2.0, 4.0, 9e-6, 0.0), (9.0, 3.0, 0.0, 2.0)))
POSE, TWIST = np.array((0.4, -0.2, 0.3)), (0.8, 0.1, 0.4)
KNOWN, UNKNOWN = ConsiderModel(2e-6, 1e-6, 1e-5, 2.5e-5), ConsiderModel(0.0, 0.0, 0.0, 0.0)


def model_of(scanner=GONIOMETER, **given):
    observation = observation_model(scanner, ObservationParameters())
    return bearing_model((scanner,), (observation,), Parameters(bearing=BearingParameters(**given)), len(PLACES))


MODEL = model_of()


def belief_at(pose, P):
    return from_belief(Belief(0, np.asarray(pose, dtype=np.float64), P))


def expected(pose, mounting, place):
    scanner = se2.compose(pose, mounting)
    return math.atan2(place[1] - scanner[1], place[0] - scanner[0]) - scanner[2]


def slopes(of, at):
    return np.array([wrap(of(at + d) - of(at - d)) / 2e-6 for d in 1e-6 * np.eye(len(at))])


def corrected(belief, measured, entry, *, model=MODEL, places=PLACES, known=UNKNOWN, cross=None):
    figures, busy = np.full(5, 9.0), None if cross is None else np.full(1, 50)
    return correct_by_bearing_alone(
        belief, measured, entry, places, model, TWIST, known, cross, busy, figures, False
    ), figures


def test_a_row_is_the_derivative_of_the_expected_bearing_also_by_what_is_considered():
    for place in PLACES:
        rows = bearing_rows(belief_at(POSE, np.eye(3)), 0.1, place, MODEL, TWIST)
        assert rows.residuals[0] == pytest.approx(wrap(0.1 - expected(POSE, GONIOMETER.mounting, place)), abs=1e-12)
        assert rows.variances[0] == pytest.approx(math.radians(0.05) ** 2)
        assert rows.jacobians[0] == pytest.approx(
            slopes(lambda x, p=place: expected(x, GONIOMETER.mounting, p), POSE), abs=1e-8
        )
        mounted = slopes(lambda m, p=place: expected(POSE, m, p), np.array(GONIOMETER.mounting))
        stands = slopes(lambda p: expected(POSE, GONIOMETER.mounting, p), place[:2])
        # A clock that is late by a second: the reflector was met where the vehicle was a second ago.
        before = se2.compose(POSE, se2.exp(-1e-6 * np.array(TWIST)))
        late = wrap(expected(before, GONIOMETER.mounting, place) - expected(POSE, GONIOMETER.mounting, place)) / 1e-6
        assert rows.constants[0] == pytest.approx([*mounted, 0.0, late, *stands], abs=1e-5)


def test_constants_are_considered_as_schmidts_filter_of_the_whole_state_does():
    rng, count = np.random.default_rng(2), 2 * len(PLACES) + 5
    for entry in range(len(PLACES)):
        root = rng.standard_normal((3, 3)) * (0.01, 0.01, 0.005)
        P, cross = root @ root.T + 1e-4 * np.eye(3), rng.normal(0.0, 1e-6, (3, count))
        belief, measured = belief_at(POSE, P), expected(POSE, GONIOMETER.mounting, PLACES[entry]) + 0.002
        rows = bearing_rows(belief, measured, PLACES[entry], MODEL, TWIST)
        seen = np.array([*range(2 * len(PLACES), count), 2 * entry, 2 * entry + 1])
        assert len(seen) == CONSTANTS
        whole, row = np.zeros((3 + count, 3 + count)), np.zeros(3 + count)
        whole[:3, :3], whole[:3, 3:], whole[3:, :3] = P, cross, cross.T
        whole[3 + seen, 3 + seen] = (2e-6, 2e-6, 1e-6, 1e-5, 2.5e-5, PLACES[entry, 2], PLACES[entry, 2])
        row[:3], row[3 + seen] = rows.jacobians[0], rows.constants[0]
        S = row @ whole @ row + math.radians(0.05) ** 2
        gain = whole @ row / S
        gain[3:] = 0.0
        joseph = np.eye(3 + count) - np.outer(gain, row)
        after_whole = joseph @ whole @ joseph.T + math.radians(0.05) ** 2 * np.outer(gain, gain)
        written = cross.copy()
        after, figures = corrected(belief, measured, entry, known=KNOWN, cross=written)
        assert (figures[USE], figures[REFLECTOR]) == (BearingUse.ACCEPTED, PLACES[entry, 3])
        assert figures[NIS] == pytest.approx(0.002**2 / S, rel=1e-6)
        assert mean_of(after) == pytest.approx(POSE + 0.002 * gain[:3], abs=1e-10)
        assert covariance_of(after) == pytest.approx(after_whole[:3, :3], abs=1e-12)
        assert written == pytest.approx(after_whole[:3, 3:], abs=1e-12)


def test_the_gate_has_one_degree_of_freedom():
    # 10.828 is the 0.999 quantile of chi-square with one degree of freedom (any table).
    sharp, exact = belief_at(POSE, 1e-16 * np.eye(3)), PLACES * (1.0, 1.0, 0.0, 1.0)
    for factor, use in ((0.999, BearingUse.ACCEPTED), (1.001, BearingUse.REJECTED)):
        off = factor * math.radians(0.05) * math.sqrt(10.828)
        measured = expected(POSE, GONIOMETER.mounting, exact[0]) + off
        for entry in (0, NOT_NAMED):
            after, figures = corrected(sharp, measured, entry, places=exact)
            assert (figures[USE], figures[REFLECTOR], after == sharp) == (use, 1.0, use == BearingUse.REJECTED)


def test_a_bearing_without_a_name_is_of_the_only_reflector_that_fits():
    belief = belief_at(POSE, np.diag((1e-4, 1e-4, 1e-5)))
    here = [expected(POSE, GONIOMETER.mounting, place) for place in PLACES]
    assert corrected(belief, here[1], NOT_NAMED)[1][REFLECTOR] == PLACES[1, 3]
    behind = np.vstack([PLACES, [*(2.0 * PLACES[0, :2] - se2.compose(POSE, GONIOMETER.mounting)[:2]), 0.0, 3.0]])
    for measured, entry, places, use in (
        (here[0], NOT_NAMED, behind, BearingUse.UNKNOWN),
        (here[0] + 0.3, NOT_NAMED, PLACES, BearingUse.REJECTED),
        (here[0], NOT_IN_MAP, PLACES, BearingUse.UNKNOWN),
        (math.nan, NOT_NAMED, PLACES, BearingUse.NONE),
        (here[0] + 0.3, 0, PLACES, BearingUse.REJECTED),
    ):
        after, figures = corrected(belief, measured, entry, places=places)
        assert (figures[USE], after == belief) == (use, True)
    # Farther than the goniometer sees, there is nobody.
    near = model_of(dataclasses.replace(GONIOMETER, range=(0.05, 3.0)))
    assert corrected(belief, here[1], NOT_NAMED, model=near)[1][USE] == BearingUse.REJECTED
    reflectors = [Reflector(id=name, x=0.0, y=float(k)) for k, name in enumerate("ABC")]
    assert entries_named(("B", "", "Z", "A"), reflectors, PLACES).tolist() == [0, NOT_NAMED, NOT_IN_MAP, 1]


def test_a_goniometer_upside_down_and_with_a_late_clock_is_understood():
    before = se2.compose(POSE, se2.exp(-0.02 * np.array(TWIST)))
    measured = -expected(before, GONIOMETER.mounting, PLACES[0])
    hanging = model_of(dataclasses.replace(GONIOMETER, upside_down=True, clock_offset=0.02))
    after, figures = corrected(belief_at(POSE, 1e-6 * np.eye(3)), measured, 0, model=hanging)
    # To first order in 20 ms, in which the bearing turns by 10 mrad.
    assert (figures[USE], figures[NIS] < 0.05) == (BearingUse.ACCEPTED, True)
    assert mean_of(after) == pytest.approx(POSE, abs=1e-3)


def test_a_reflector_at_the_goniometer_itself_gives_no_number_that_is_none():
    there = np.array([[*se2.compose(POSE, GONIOMETER.mounting)[:2], 1e-6, 0.0]])
    after, _ = corrected(belief_at(POSE, 1e-4 * np.eye(3)), 0.3, 0, places=there)
    assert np.isfinite(mean_of(after)).all()
    assert np.linalg.eigvalsh(covariance_of(after)).min() > 0.0


def test_a_real_goniometer_whose_bearings_are_off_by_degrees_is_not_believed_more_than_it_is_right():
    """Nine places at rest, 200 turns each; what it is off by stays, so that it is considered and does not average."""
    folder = REPOSITORY.parent / "shared" / "data" / "goniometer"
    if not folder.exists():
        pytest.skip("the recordings of a real goniometer are not here")
    marks = np.loadtxt(folder / "landmark.csv", delimiter=",")
    still = OdometryParameters(acceleration=0.0, turn_acceleration=0.0, forward_per_sqrt_s=0.0, heading_per_sqrt_s=0.0)
    known = Uncertainty(survey=0.12, mounting_heading=0.02)
    nees, wrong, stopped, said = [], [], 0, 0
    for path in sorted(folder.glob("X*_Y*.csv")):
        true, records = np.array((float(path.stem[1:4]), float(path.stem[6:9]), math.pi / 2)), []
        for k, turn in enumerate(np.radians(np.loadtxt(path, delimiter=","))):
            records.append(Odometry(k * 200_000_000, np.zeros(3)))
            records += [Reflex(k * 200_000_000 + i * 50_000_000, float(wrap(b))) for i, b in enumerate(turn)]
        log = RecordLog.collect(records)
        setup = LocalizerSetup(
            reflectors=ReflectorMap(tuple(Reflector(id=f"{i}", x=x, y=y) for i, (x, y) in enumerate(marks.tolist()))),
            scanners=(dataclasses.replace(GONIOMETER, mounting=np.zeros(3), bearing_sigma_deg=1.0),),
            parameters=Parameters(odometry=still),
            uncertainty=known,
        )
        start = Belief(0, true + np.array((0.1, 0.1, 0.05)), np.diag((0.15**2, 0.15**2, 0.1**2)))
        result = run(log, setup, start)
        error = result.means[-1] - true
        nees.append(error @ np.linalg.solve(result.covariances[-1], error))
        assert (result.bearings[:, USE] == BearingUse.ACCEPTED).mean() > 0.9
        # 2-sigma is beyond what the supervisor allows: nobody drives by it.
        assert (result.modes == Mode.FAIL).all()
        sure = run(log, dataclasses.replace(setup, uncertainty=Uncertainty()), start)
        off = np.hypot(*(sure.means[:, :2] - true[:2]).T)
        wrong.append(np.count_nonzero((sure.modes == Mode.OPERATIONAL) & (off > 0.1)))
        stopped += sure.modes[-1] == Mode.FAIL
        said += bool(bearing_findings(sure))
        # Of three degrees of freedom four bearings leave one: what two places are off by no bearing contradicts.
        assert sure.modes[-1] == Mode.FAIL or off[-1] < 0.1
    # Chi-square, 3 degrees of freedom at each of nine places.
    assert sum(nees) < chi2.ppf(0.99, 27), nees
    # Taken for as good as a laser, bearings contradict each other there, and nobody drives by them for long.
    assert (stopped, said) == (7, 7)
    assert max(wrong) < 0.2 * 800, wrong


def standing(off: float, seed: int, degrees: float = 0.3):
    """A vehicle that stands among four reflectors and meets each in turn, the last one of which is off along y [m]."""
    rng, places = np.random.default_rng(seed), np.array(((4.0, 1.0), (-3.0, 3.0), (-2.0, -4.0), (3.0, -3.0)))
    true, records = places + np.array([(0.0, off * (k == 3)) for k in range(4)]), []
    for k in range(1200):
        bearing = (
            expected(np.zeros(3), GONIOMETER.mounting, true[k % 4]) + math.radians(degrees) * rng.standard_normal()
        )
        records += [Odometry(k * 25_000_000, np.zeros(3)), Reflex(k * 25_000_000, bearing, "ABCD"[k % 4])]
    setup = LocalizerSetup(
        reflectors=ReflectorMap(
            tuple(Reflector(id="ABCD"[k], x=x, y=y, sigma=1e-9) for k, (x, y) in enumerate(places.tolist()))
        ),
        scanners=(dataclasses.replace(GONIOMETER, bearing_sigma_deg=degrees),),
        parameters=Parameters(bearing=BearingParameters(lasting_window=10.0)),
        uncertainty=Uncertainty(mounting_position=0.0, mounting_heading=0.0, range_bias=0.0, survey=0.0, clock=0.0),
    )
    return RecordLog.collect(records), setup, run(RecordLog.collect(records), setup, NEAR)


def test_innovations_that_do_not_average_out_stop_the_vehicle_as_their_mean_says():
    log, setup, columns = standing(0.18, 1, 1.0)
    use, reflector, nis, off, lasting = columns.bearings.T
    assert (columns.modes[lasting > 0.0] == Mode.FAIL).all()
    assert (lasting[800:] > 0.0).all()
    # The mean of each reflector, over all that was met until then, without a recursion.
    variance, noise, times = off**2 / nis, math.radians(1.0) ** 2, np.arange(1200) * 0.025
    statistics = np.zeros(1200)
    for k in range(100, 1200):
        means, spreads = [], []
        for number in range(4):
            rows = np.flatnonzero((reflector[: k + 1] == number) & (use[: k + 1] == BearingUse.ACCEPTED))
            weights = np.exp((times[rows] - times[rows[-1]]) / 10.0) * noise / variance[rows]
            means.append(np.average(off[rows], weights=weights))
            spreads.append(np.sum(weights**2 * np.maximum(variance[rows], noise)) / np.sum(weights) ** 2)
        middle = np.average(means, weights=1.0 / np.array(spreads))
        statistics[k] = np.sum((np.array(means) - middle) ** 2 / spreads)
    # Five sigma of three degrees of freedom; the rule's closed form is within a few per cent of the quantile.
    first, limit = int(np.argmax(lasting)), chi2.isf(2.87e-7, 3)
    assert 100 < first < 800
    assert statistics[first] == pytest.approx(limit, rel=0.1)
    assert statistics[100:first].max() < 1.1 * limit
    (finding,) = bearing_findings(columns)
    assert "most those of D (" in finding.found
    project = Project(reflectors=setup.reflectors, scanners=setup.scanners, parameters=setup.parameters)
    inputs = RunInput.of(project, log, Start(NEAR, StartOrigin.GIVEN)).with_setup(setup)
    kinds = {event.kind: event for event in events(EventsInput(judged_run(inputs))).events}
    # Nothing was seen by a laser, and yet the vehicle is not blind.
    assert set(kinds) <= {EventKind.DISAGREE, EventKind.FAIL, EventKind.RECOVERED, EventKind.JUMP}
    disagree = kinds[EventKind.DISAGREE]
    assert disagree.time == pytest.approx(first * 0.025)
    assert "most of D (by +" in told(disagree)
    off_rule = dataclasses.replace(setup.parameters, bearing=BearingParameters(lasting_limit=0.0))
    free = run(log, dataclasses.replace(setup, parameters=off_rule), NEAR)
    assert (free.modes == Mode.OPERATIONAL).all()


def test_innovations_that_average_out_stop_nobody_and_those_that_are_harmless_neither():
    for off, seed in ((0.0, 2), (0.0, 3), (0.0, 4), (0.02, 5)):
        _, _, columns = standing(off, seed)
        assert not columns.bearings[:, 4].any()
        assert (columns.modes == Mode.OPERATIONAL).all()


LASER = Scanner(name="laser")
SETUP = LocalizerSetup(
    reflectors=ReflectorMap(tuple(Reflector(id=n, x=x, y=y) for n, x, y in (("A", 3, 1), ("B", -2, 4), ("C", 2, -5)))),
    scanners=(LASER, GONIOMETER),
    parameters=Parameters(),
    tags=(Tag(id="7", x=2.0, y=0.0, heading=0.5),),
)
NEAR = Belief(0, np.array((0.01, 0.0, 0.0)), np.diag((1e-3, 1e-3, 1e-4)))


def mixed():
    """A vehicle that stands, with reflexes named and not and foreign, empty turns, detections of a laser, a tag."""
    rng, records = np.random.default_rng(0), []
    for k in range(150):
        stamp = k * 100_000_000
        records.append(Odometry(stamp, np.zeros(3)))
        place = SETUP.reflectors.centers[k % 3]
        bearing = expected(np.zeros(3), GONIOMETER.mounting, place) + rng.normal(0.0, 1e-3)
        name = ("", "ABC"[k % 3], "", "Z", "")[k % 5]
        records.append(Reflex(stamp + 31 * (k % 4), bearing if k % 11 else math.nan, name if k % 11 else ""))
        if k % 6 == 0:
            rows = np.array([(2.0, 0.0, 0.5, 0.02, 0.02, 0.02)]) + np.array([[*rng.normal(0.0, 0.02, 3), 0, 0, 0]])
            records.append(TagSightings(stamp, rows, ("7",)))
        if k % 5 == 2:
            seen = np.array([(math.hypot(3.0, 1.0), math.atan2(1.0, 3.0))]) + rng.normal(0.0, 0.003, (1, 2))
            records.append(Detections(stamp, seen))
    return RecordLog.collect(records, ("laser", "goniometer"))


def grown(log, setup, start):
    live = GrowingRun(setup, start)
    for record in log.records():
        live.feed(record)
    live.flush()
    return live.columns()


@pytest.mark.parametrize("consider", few_of((True, False), (True,)))
def test_live_is_the_whole_run_to_the_last_bit(consider):
    filtering = dataclasses.replace(SETUP.parameters.filter, consider=consider)
    setup = dataclasses.replace(SETUP, parameters=dataclasses.replace(SETUP.parameters, filter=filtering))
    log = mixed()
    whole = run(log, setup, NEAR)
    live = grown(log, setup, NEAR)
    assert whole.stamps_ns.tolist() == live.stamps_ns.tolist()
    for name in ("means", "covariances", "modes", "tags", "bearings", "d2", "status"):
        assert getattr(whole, name).tobytes() == getattr(live, name).tobytes(), name
    for name in ("is_reflex", "numbers", "bearings"):
        assert getattr(whole.detected.bearings, name).tobytes() == getattr(live.detected.bearings, name).tobytes()
    assert whole.detected.bearings.reflectors == live.detected.bearings.reflectors
    assert whole.final == live.final
    for cycle in range(0, len(whole), 7):
        a, b = whole.estimate(cycle), live.estimate(cycle)
        assert (a.bearing is None, a.tags is None) == (b.bearing is None, b.tags is None)
        assert a.prior.covariance.tobytes() == b.prior.covariance.tobytes()
    counts = np.bincount(whole.bearings[:, USE].astype(int), minlength=4)
    # 14 of 150 are empty turns; of the others those that the map lacks; one in a thousand is outside of the gate.
    assert (counts[BearingUse.NONE], counts[BearingUse.UNKNOWN]) == (14, 27)
    assert counts[BearingUse.REJECTED] <= 2
    # Through a checkpoint in the middle, and with a setup that looks at no bearings from there on.
    assert state_before(whole, log, 41).tracking.belief == from_belief(whole.estimate(40).posterior)
    blind = dataclasses.replace(setup.parameters, bearing=BearingParameters(enabled=False))
    segments = (RunSegment(0, setup), RunSegment(40, dataclasses.replace(setup, parameters=blind)))
    cut = run_segments(log, segments, NEAR)
    again = run_segments(log, segments, NEAR, earlier=run_segments(log, segments[:1], NEAR))
    assert cut.means[:40].tobytes() == whole.means[:40].tobytes()
    assert (cut.means.tobytes(), cut.bearings.tobytes()) == (again.means.tobytes(), again.bearings.tobytes())
    assert not cut.bearings[whole.detected.bearings.rows_before(40) :].any()
    covered = run_segments(log, (RunSegment(0, setup, covered=True),), NEAR)
    assert not covered.bearings[:, USE].any()


def test_bearings_that_fit_nothing_make_a_vehicle_lost_and_those_that_fit_find_it_again():
    setup = dataclasses.replace(SETUP, scanners=(GONIOMETER,), tags=())
    records = []
    for k in range(600):
        stamp, place = k * 40_000_000, SETUP.reflectors.centers[k % 3]
        pose = np.array((0.0, 0.0, 0.6 if 150 <= k < 330 else 0.0))
        records += [Odometry(stamp, np.zeros(3)), Reflex(stamp, expected(pose, GONIOMETER.mounting, place))]
    columns = run(RecordLog.collect(records), setup, Belief(0, np.zeros(3), np.diag((1e-6, 1e-6, 1e-6))))
    assert (columns.modes[:150] == Mode.OPERATIONAL).all()
    lost = int(np.argmax(columns.modes == Mode.LOST))
    # A third of a scan each, and fifteen scans against the pose: at most 45 of them.
    assert 150 < lost <= 150 + 45
    assert (columns.modes[lost:330] == Mode.LOST).all()
    assert columns.modes[-1] == Mode.OPERATIONAL
    assert (columns.bearings[160:330, USE] == BearingUse.REJECTED).all()


def turns(count: int, fits: tuple[bool, ...], false: int, at_rest=(0.0, 0.0, 0.0)):
    """Modes of a vehicle at rest among three reflectors: in each turn some are met, and some things that are none."""
    rng, setup, records = np.random.default_rng(4), dataclasses.replace(SETUP, scanners=(GONIOMETER,), tags=()), []
    for turn in range(count):
        bearings = [
            expected(np.array(at_rest), GONIOMETER.mounting, place)
            for place, is_met in zip(SETUP.reflectors.centers, fits, strict=True)
            if is_met
        ]
        # Bearings of things that stand still, away from those of all reflectors.
        free = [b for b in np.arange(-3.0, 3.0, 0.1) if all(abs(wrap(b - e)) > 0.2 for e in EXPECTED)]
        bearings += [free[7 * (k + 1)] for k in range(false)]
        for k, bearing in enumerate(bearings):
            stamp = turn * 125_000_000 + k * 10_000_000
            records += [Odometry(stamp, np.zeros(3)), Reflex(stamp, bearing + 1e-4 * rng.standard_normal())]
    return run(RecordLog.collect(records), setup, Belief(0, np.zeros(3), np.diag((1e-6, 1e-6, 1e-6))))


EXPECTED = [expected(np.zeros(3), GONIOMETER.mounting, place) for place in SETUP.reflectors.centers]


@pytest.mark.parametrize("met", [(True, False, False), (False, False, True)])
def test_a_pose_that_one_bearing_fits_while_two_fit_nothing_and_two_reflectors_are_missing_is_none(met):
    """As where a vehicle is elsewhere in a hall of three reflectors, one of which lies in a fitting direction."""
    columns = turns(40, met, false=2)
    lost = int(np.argmax(columns.modes == Mode.LOST))
    assert 0 < lost <= 3 * 15
    assert (columns.modes[lost:] != Mode.OPERATIONAL).all()


@pytest.mark.parametrize(
    ("met", "false"), [((True, True, True), 2), ((True, True, False), 2), ((True, True, False), 1)]
)
def test_things_that_the_map_lacks_beside_reflectors_that_are_met_lose_nobody(met, false):
    """Two of five bearings, also while one reflector is hidden."""
    assert (turns(400, met, false).modes == Mode.OPERATIONAL).all()


def test_a_vehicle_that_bearings_alone_do_not_find_is_told_so():
    setup = dataclasses.replace(SETUP, scanners=(GONIOMETER,), tags=())
    records = []
    for k in range(90):
        bearing = expected(np.zeros(3), GONIOMETER.mounting, SETUP.reflectors.centers[k % 3])
        records += [Odometry(k * 40_000_000, np.zeros(3)), Reflex(k * 40_000_000, bearing, "ABC"[k % 3])]
    columns = run(RecordLog.collect(records), setup, state_unlocated(0, anywhere(setup.index.places)))
    assert (columns.modes == Mode.INITIALIZING).all()
    (finding,) = bearing_findings(columns)
    assert "bearings alone do not find its pose" in finding.found
    assert "--initial-pose" in finding.remedy
