"""Association over several scans: against poses written plainly, by hand, live to the last bit, and on a real robot."""

from __future__ import annotations

import math

import numpy as np
import pytest

from commission.geometry import se2
from commission.geometry.gaussian import chi_square_gate
from commission.io.project_file import apply_settings, load_project
from commission.io.recordings.base import load_log
from commission.localization import whole_run
from commission.localization.estimate import Belief, Mode, Status
from commission.localization.kalman import correct
from commission.localization.localizer import Localizer
from commission.localization.observation import ObservationModel
from commission.localization.pose_gaussian import PoseGaussian, covariance_of, mean_of
from commission.localization.reflector_index import build_index
from commission.localization.rival_poses import poses_of
from commission.localization.scan_rows import ScanRows
from commission.localization.setup import LocalizerSetup
from commission.localization.several_scans import (
    SEEN_PER_FALSE,
    decide_over_scans,
    is_contested,
    keep_own,
    mixed,
)
from commission.localization.supervisor import supervisor_limits
from commission.localization.whole_run import run, run_segments, state_before
from commission.site.parameters import AssociationParameters, OdometryParameters, Parameters, SupervisorParameters
from commission.site.record_log import RecordLog
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from commission.studies.run import references_of
from tests.localization.plain_observation import observed
from tests.localization.plain_several_scans import Pose, decided, moved
from tests.localization.test_whole_run import assert_same_estimate

MODEL = ObservationModel(0.3, 0.1, 0.2, 0.05**2, 0.01**2, 0.0)
MOUNTING, R = np.array([0.3, 0.1, 0.2]), np.diag([0.05**2, 0.01**2])
GATE = chi_square_gate(0.99, 2)
CLUTTERED = (
    "observation.range_sigma=0.15",
    "observation.bearing_sigma=0.02",
    "odometry.forward_per_sqrt_m=0.12",
    "odometry.lateral_per_sqrt_m=0.06",
    "odometry.heading_per_sqrt_m=0.05",
    "odometry.heading_per_sqrt_rad=0.13",
    "odometry.gap_speed=0.2",
    "odometry.gap_turn_rate=0.6",
)
"""What the real robot shows against its reference, and how fast it can drive and turn."""


def reflectors(*places: tuple[float, float]) -> ReflectorMap:
    return ReflectorMap(tuple(Reflector(id=f"R{i}", x=x, y=y) for i, (x, y) in enumerate(places)))


class Tracked:
    """The kernel, scan by scan, with the poses that it keeps."""

    def __init__(self, places: list[tuple[float, float]], start: PoseGaussian) -> None:
        self.index = build_index(reflectors(*places), np.zeros(len(places)))
        self.own, self.poses = start, poses_of(None, wanted=True)
        assert self.poses is not None

    def scan(self, prior: PoseGaussian, scan: np.ndarray) -> list[int]:
        """Take a scan in; return the reflector of each detection, or -1."""
        index, count = self.index, len(scan)
        chosen = np.full(count, -1)
        aims = np.column_stack((np.cos(0.2 + scan[:, 1]), np.sin(0.2 + scan[:, 1]), np.zeros(count)))
        assert self.poses is not None
        nothing = np.zeros(count, np.int8), np.full(count, -1), np.full(count, np.nan)
        rows = ScanRows(0, count, scan, aims, *nothing)
        decision = decide_over_scans(self.poses, prior, rows, MODEL, GATE, index, None, chosen)
        own = decision.prior
        for z, entry in zip(scan.tolist(), chosen.tolist(), strict=True):
            if entry >= 0:
                x, y, variance = (float(each) for each in index.places[entry, :3])
                own = correct(own, z[0], z[1], x, y, variance, MODEL)
        self.own = mixed(own, decision.mix)
        keep_own(self.poses, self.own, False)
        return [int(index.places[entry, 3]) if entry >= 0 else -1 for entry in chosen.tolist()]

    def rivals(self) -> list[tuple[float, np.ndarray]]:
        """Weight and mean of each, the likeliest first."""
        assert self.poses is not None
        kept = np.flatnonzero(self.poses.weights > -math.inf)
        return [(math.exp(self.poses.weights[k]), self.poses.beliefs[k, :3].copy()) for k in kept]


def gaussian(mean: np.ndarray, cov: np.ndarray) -> PoseGaussian:
    x, y, theta = mean.tolist()
    return PoseGaussian(x, y, theta, *(float(cov[i, j]) for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))))


def test_what_a_scan_cannot_tell_the_next_ones_decide() -> None:
    # Straight ahead at 5.0 and 5.6 m, the vehicle known to 0.2 m along its way: 5.28 m may be either. One beside it
    # then tells the place along the way.
    wide = PoseGaussian(0.0, 0.0, 0.0, 0.04, 0.0, 0.0, 1e-8, 0.0, 1e-6)
    tracked = Tracked([(5.3, 0.1), (5.9, 0.1), (0.7, 6.1)], wide)
    z = observed(np.array([0.32, 0.0, 0.0]), MOUNTING, np.array([[5.9, 0.1]]))
    assert tracked.scan(wide, z) == [0]
    (weight, there), *others = tracked.rivals()
    # Range 0.28 m too long for one, 0.32 m too short for the other; of variance 0.04 + 0.0025.
    odds = math.exp(-0.5 * (0.32**2 - 0.28**2) / 0.0425)
    assert weight == pytest.approx(odds, rel=1e-3)
    assert there[0] == pytest.approx(0.32 * 0.04 / 0.0425, abs=1e-3)
    none = math.exp(0.5 * 0.28**2 / 0.0425) * 2.0 * math.pi * math.sqrt(0.0425 * 1.01e-4) / SEEN_PER_FALSE
    assert [each[0] for each in others] == [pytest.approx(none, rel=0.02)]
    assert is_contested(tracked.poses, tracked.own, supervisor_limits(SupervisorParameters()))
    side = observed(np.array([0.32, 0.0, 0.0]), MOUNTING, np.array([[0.7, 6.1]]))
    assert tracked.scan(tracked.own, side) == [2]
    assert tracked.own.x == pytest.approx(0.32, abs=0.03)
    assert not is_contested(tracked.poses, tracked.own, supervisor_limits(SupervisorParameters()))


def test_poses_are_those_of_plain_hypotheses() -> None:
    rng, changed, rivals, together = np.random.default_rng(5), 0, 0, 0
    for _ in range(12):
        places = [tuple(place) for place in rng.uniform(-6.0, 6.0, (5, 2)).tolist()]
        places += [(x + dx, y + dy) for (x, y), (dx, dy) in zip(places, rng.normal(0.0, 0.2, (5, 2)), strict=True)]
        P = np.diag([0.15, 0.15, 0.05]) ** 2
        pose = rng.normal(size=3) * [0.15, 0.15, 0.05]
        tracked = Tracked(places, gaussian(np.zeros(3), P))
        plain, in_order = [Pose(np.zeros(3), P)], tracked.index.places[:, :2]
        for _ in range(6):
            move = rng.normal(size=3) * [0.1, 0.02, 0.1]
            before, mean = plain[0], mean_of(tracked.own)
            c, s = math.cos(mean[2]), math.sin(mean[2])
            step = np.array([c * move[0] - s * move[1], s * move[0] + c * move[1], move[2]])
            F = np.array([[1.0, 0.0, -step[1]], [0.0, 1.0, step[0]], [0.0, 0.0, 1.0]])
            A = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
            cov = F @ covariance_of(tracked.own) @ F.T + A @ np.diag([0.05, 0.02, 0.02]) ** 2 @ A.T
            prior = gaussian(mean + step, cov)
            pose = se2.compose(pose, move + rng.normal(size=3) * [0.05, 0.02, 0.02])
            scan = observed(pose, MOUNTING, np.array(places)[rng.permutation(10)[:2]])
            scan = scan + rng.normal(size=scan.shape) * [0.05, 0.01]
            own = Pose(mean + step, cov)
            told, rest = decided(
                [own, *(moved(each, before, own) for each in plain[1:])], scan, MOUNTING, in_order, R, GATE
            )
            named = tracked.scan(prior, scan)
            order = [int(tracked.index.places[e, 3]) if e >= 0 else -1 for e in told.entries]
            assert named == order
            assert mean_of(tracked.own) == pytest.approx(told.mean, abs=1e-6)
            assert covariance_of(tracked.own) == pytest.approx(told.covariance, abs=1e-7)
            found = tracked.rivals()
            assert [w for w, _ in found] == pytest.approx([each.weight for each in rest], rel=1e-4)
            for (_, there), each in zip(found, rest, strict=True):
                assert there == pytest.approx(each.mean, abs=1e-6)
            changed += told.root != 0
            rivals, together = rivals + len(rest), together + (told.spread is not None)
            plain = [told, *rest]
    assert changed > 3
    assert rivals > 60
    assert together > 10


def doubles() -> tuple[LocalizerSetup, RecordLog, Belief]:
    """A slow drive among pairs of reflectors 0.25 m apart, one or two detections a scan."""
    rng = np.random.default_rng(2)
    places = rng.uniform(0.0, 12.0, (8, 2))
    places = np.vstack((places, places + rng.normal(0.0, 0.18, places.shape)))
    noise = OdometryParameters(forward_per_sqrt_m=0.15, lateral_per_sqrt_m=0.08, heading_per_sqrt_rad=0.15)
    pose, start = np.array([6.0, 3.0, 0.0]), np.array([0.1, 0.1, 0.03])
    initial = Belief(0, pose + rng.normal(size=3) * start, np.diag(np.square(start)))
    step, moves, seen, offsets = np.array([0.03, 0.0, 0.02]), [], [], [0]
    for k in range(160):
        error = rng.normal(size=3) * [0.03, 0.015, 0.02]
        moves.append(step if k else np.zeros(3))
        pose = se2.compose(pose, step + error) if k else pose
        here = rng.permutation(16)[: 1 + k % 2]
        seen.append(observed(pose, np.zeros(3), places[here]) + rng.normal(size=(len(here), 2)) * [0.1, 0.01])
        offsets.append(offsets[-1] + len(here))
    stamps = 100_000_000 * np.arange(160, dtype=np.int64)
    log = RecordLog(
        odometry_stamps_ns=stamps,
        displacements=np.array(moves),
        detection_stamps_ns=stamps,
        detection_offsets=np.array(offsets),
        range_bearing=np.vstack(seen),
    )
    parameters = apply_settings(
        Parameters(odometry=noise, association=AssociationParameters(method="several_scans")),
        ("observation.range_sigma=0.1", "observation.bearing_sigma=0.01", "supervisor.position_limit=0.5"),
    )
    the_map = reflectors(*(tuple(place) for place in places.tolist()))
    return LocalizerSetup(reflectors=the_map, scanners=(Scanner(),), parameters=parameters), log, initial


@pytest.mark.with_all_seeds
def test_live_resumed_and_whole_runs_agree_to_the_last_bit_while_poses_contest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(whole_run, "CHECKPOINT_CYCLES", 7)
    setup, log, initial = doubles()
    arrays, localizer = run(log, setup, initial), Localizer(setup, initial)
    estimates = [estimate for record in log.records() for estimate in localizer.feed(record)]
    estimates += localizer.flush()
    for cycle, estimate in enumerate(estimates):
        assert_same_estimate(estimate, arrays.estimate(cycle))
    assert localizer.state == arrays.final
    contested = 0
    for cycle in (5, 40, 77, 131):
        state = state_before(arrays, log, cycle)
        assert state.rivals is not None
        contested += int(np.isfinite(state.rivals.weights).sum())
        again = run_segments(log, arrays.segments, initial, earlier=arrays)
        assert again.final == arrays.final
    assert contested > 4


@pytest.mark.with_all_seeds
def test_a_real_robot_among_others_that_look_like_landmarks_is_kept(shared_data) -> None:
    folder = shared_data / "robot_in_clutter"
    project, log = load_project(folder), load_log(folder / "recording")
    x, y, theta, *sigmas = (float(each) for each in (folder / "initial_pose").read_text().split(","))
    initial = Belief(int(log.first_ns), np.array([x, y, theta]), np.diag(np.square(sigmas)))
    wrong = {}
    for method in ("exclusive", "several_scans"):
        parameters = apply_settings(
            project.parameters, (*CLUTTERED, f"association.method={method}", "supervisor.find_again=false")
        )
        columns = run(
            log,
            LocalizerSetup(reflectors=project.reflectors, scanners=project.scanners, parameters=parameters),
            initial,
        )
        distance = np.hypot(*(columns.means - references_of(log, columns))[:, :2].T)
        assert not (distance[columns.modes == Mode.OPERATIONAL] > 0.5).any()
        wrong[method] = math.sqrt(np.nanmean(distance**2)), (distance > 0.5).mean()
        accepted = (columns.status == Status.INLIER).mean()
    # By one pose, not looking for itself, it is lost for good after some minutes; most detections are of landmarks.
    assert wrong["exclusive"][1] > 0.3
    assert wrong["several_scans"][0] < 0.2
    assert wrong["several_scans"][1] < 0.005
    assert accepted > 0.75


@pytest.mark.with_all_seeds
@pytest.mark.parametrize("method", ["several_scans", "exclusive"])
def test_a_real_robot_that_sees_one_or_two_things_at_a_time_is_found_each_time_that_it_is_lost(
    shared_data, method: str
) -> None:
    folder = shared_data / "robot_in_clutter"
    project, log = load_project(folder), load_log(folder / "recording")
    x, y, theta, *sigmas = (float(each) for each in (folder / "initial_pose").read_text().split(","))
    initial = Belief(int(log.first_ns), np.array([x, y, theta]), np.diag(np.square(sigmas)))
    limits = ("supervisor.position_limit=0.5", "supervisor.heading_limit=0.2")
    parameters = apply_settings(project.parameters, (*CLUTTERED, *limits, f"association.method={method}"))
    setup = LocalizerSetup(reflectors=project.reflectors, scanners=project.scanners, parameters=parameters)
    columns = run(log, setup, initial)
    distance = np.hypot(*(columns.means - references_of(log, columns))[:, :2].T)
    operational = columns.modes == Mode.OPERATIONAL
    assert not (distance[operational] > 0.5).any()
    # It was lost from 25 s on to the end; now three times, for a third of the time.
    assert operational.mean() > 0.5
    assert (columns.modes == Mode.LOST).mean() < 0.4
    assert math.sqrt(np.nanmean(distance**2)) < 0.3
