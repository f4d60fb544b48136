"""The filter that considers constants against a plain dense one, and against errors of map and mounting that stay."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from commission.localization.cross_covariance import columns_of, cross_covariance
from commission.localization.estimate import Mode, Status
from commission.localization.localizer import Localizer
from commission.localization.setup import LocalizerSetup
from commission.localization.whole_run import run
from commission.site.parameters import AssociationParameters, FilterParameters, ObservationParameters, Parameters
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
from commission.site.uncertainty import Uncertainty
from tests.localization.drives import Plan, random_drive, random_map
from tests.localization.plain_consider import PlainConsidering

FRONT = Scanner(mounting=np.array([0.3, 0.1, 0.2]))
REAR = Scanner(name="rear", mounting=np.array([-0.4, -0.2, 2.8]))
CONSIDERING = FilterParameters(consider=True)
LARGE = Uncertainty(survey=0.02, mounting_position=0.01, mounting_heading=0.01, range_bias=0.03, clock=0.05)


def considered(
    reflectors: ReflectorMap, uncertainty: Uncertainty = LARGE, count: int = 1, **groups: object
) -> LocalizerSetup:
    parameters = Parameters(**{"filter": CONSIDERING, **groups})  # type: ignore[arg-type]
    return LocalizerSetup(
        reflectors=reflectors, scanners=(FRONT, REAR)[:count], parameters=parameters, uncertainty=uncertainty
    )


def surveyed(rng: np.random.Generator, reflectors: ReflectorMap) -> ReflectorMap:
    """The same map; half of its reflectors have a sigma of their own."""
    return ReflectorMap(
        tuple(
            dataclasses.replace(each, sigma=float(rng.uniform(0.0, 0.03)) if i % 2 else 0.0)
            for i, each in enumerate(reflectors.reflectors)
        )
    )


@pytest.mark.parametrize(
    ("plan", "count", "groups"),
    [
        (Plan(scans=500, clutter=0.3, reach=7.0, odometry_ns=40_000_000), 1, {}),
        (Plan(scans=60, clutter=1.0, scan_offset_ns=7_000_000), 2, {}),
        (Plan(scans=60, odometry_ns=100_000_000, scan_ns=30_000_000), 1, {}),
        (
            Plan(scans=60, clutter=1.0),
            2,
            {
                "association": AssociationParameters(enabled=False),
                "observation": ObservationParameters(range_bias=0.03),
            },
        ),
    ],
    ids=["long", "two scanners between odometry", "fast scans", "no association filter"],
)
def test_the_filter_agrees_with_a_dense_one_to_the_last_digits(plan: Plan, count: int, groups: dict) -> None:
    rng = np.random.default_rng(11)
    setup = considered(surveyed(rng, random_map(rng, 12)), count=count, **groups)
    drive = random_drive(setup, rng, plan)
    columns = run(drive.log, setup, drive.initial)
    plain = PlainConsidering(
        setup.reflectors, FRONT, setup.parameters, drive.initial, scanners=setup.scanners, uncertainty=LARGE
    )
    cycles = plain.run(drive.log)
    assert len(cycles) == len(columns) == plan.scans
    priors = columns.priors.rows()
    for name, found in (("prior_mean", priors.means), ("mean", columns.means)):
        expected = np.array([cycle[name] for cycle in cycles])
        np.testing.assert_allclose(np.sin(0.5 * (found - expected)), 0.0, rtol=0.0, atol=1e-9)
    for name, found in (("prior_cov", priors.covariances), ("cov", columns.covariances)):
        expected = np.array([cycle[name] for cycle in cycles])
        size = np.sqrt(np.einsum("kii,kjj->kij", expected, expected))
        np.testing.assert_allclose((found - expected) / size, 0.0, rtol=0.0, atol=1e-9)
    assert (columns.status == Status.INLIER).tolist() == [s == "inlier" for cycle in cycles for s in cycle["status"]]
    inlier = columns.status == Status.INLIER
    for name, key in (("reflector", "chosen"), ("d2", "d2")):
        expected = np.array([value for cycle in cycles for value in cycle[key]])
        np.testing.assert_allclose(getattr(columns, name)[inlier], expected[inlier], rtol=1e-7, atol=1e-9)
    # The covariance with the constants is what the next cycle begins with: in the order of the map, not of its cells.
    assert columns.final.cross is not None
    assert setup.constants is not None
    order = setup.index.places[:, 3].astype(int)
    dense = np.concatenate([plain.cross[:, [2 * i, 2 * i + 1]] for i in order] + [plain.cross[:, 24:]], axis=1)
    scale = np.sqrt(np.outer(np.diag(plain.cov), np.diag(plain.constant)[_columns(order, count)]))
    last = columns.final.tracking.belief
    shift = np.array(
        [
            [1.0, 0.0, columns.final.tracking.pivot[1] - last.y],
            [0.0, 1.0, last.x - columns.final.tracking.pivot[0]],
            [0, 0, 1],
        ]
    )
    np.testing.assert_allclose((shift @ columns.final.cross.columns - dense) / scale, 0.0, rtol=0.0, atol=1e-9)


def _columns(order: np.ndarray, count: int) -> list[int]:
    """Columns of the dense filter in the order of the compiled one."""
    return [c for i in order for c in (2 * i, 2 * i + 1)] + list(range(24, 24 + 5 * count))


def test_a_reflector_that_is_seen_a_thousand_times_says_no_more_than_its_survey() -> None:
    # A vehicle at rest and three reflectors: without noise of odometry the pose would become exact.
    rng = np.random.default_rng(0)
    setup = considered(random_map(rng, 5), Uncertainty(mounting_position=0.0, mounting_heading=0.0))
    drive = random_drive(setup, rng, Plan(scans=2000, speed=0.0, clutter=0.0))
    sure = dataclasses.replace(setup, parameters=Parameters(filter=FilterParameters(consider=False)))
    with_constants, without = (run(drive.log, each, drive.initial) for each in (setup, sure))
    floor, noise = (np.sqrt(each.covariances[-1, 0, 0]) for each in (with_constants, without))
    assert noise < 0.0015
    # Five places of 3 mm each: 3 mm / sqrt(5), and some more for their geometry and the range.
    assert 0.0013 < floor < 0.006
    half = np.sqrt(with_constants.covariances[1000, 0, 0])
    assert floor == pytest.approx(half, rel=0.05), "it has long stopped to shrink"


def test_without_anything_uncertain_considering_changes_nothing_but_the_last_digits() -> None:
    rng = np.random.default_rng(2)
    nothing = Uncertainty(survey=0.0, mounting_position=0.0, mounting_heading=0.0, range_bias=0.0, clock=0.0)
    setup = considered(random_map(rng, 12), nothing)
    drive = random_drive(setup, rng, Plan(scans=200))
    plain = dataclasses.replace(setup, parameters=Parameters(filter=FilterParameters(consider=False)))
    one, other = run(drive.log, setup, drive.initial), run(drive.log, plain, drive.initial)
    np.testing.assert_allclose(one.means, other.means, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(one.covariances, other.covariances, rtol=1e-9, atol=1e-18)
    assert one.status.tobytes() == other.status.tobytes()
    assert one.final.cross is None, "nothing is correlated with the pose"


def test_the_state_of_a_filter_that_considers_nothing_holds_no_covariance_with_constants() -> None:
    rng = np.random.default_rng(2)
    setup = dataclasses.replace(
        considered(random_map(rng, 12)), parameters=Parameters(filter=FilterParameters(consider=False))
    )
    drive = random_drive(setup, rng, Plan(scans=20))
    assert setup.constants is None
    assert run(drive.log, setup, drive.initial).final.cross is None


def test_of_another_map_only_what_is_the_same_constant_stays_correlated() -> None:
    rng = np.random.default_rng(5)
    setup = considered(random_map(rng, 12), count=2)
    drive = random_drive(setup, rng, Plan(scans=40))
    cross = run(drive.log, setup, drive.initial).final.cross
    assert cross is not None
    every = list(setup.reflectors.reflectors)
    every[3] = dataclasses.replace(every[3], x=every[3].x + 0.01)
    every[4] = dataclasses.replace(every[4], sigma=0.001)
    every = [*every[:7], *every[8:], Reflector(id="new", x=1.0, y=1.0)]
    turned = dataclasses.replace(REAR, mounting=np.array([-0.4, -0.2, 2.9]))
    edited = LocalizerSetup(
        reflectors=ReflectorMap(tuple(every)), scanners=(turned, FRONT), parameters=setup.parameters, uncertainty=LARGE
    )
    columns = columns_of(cross, edited.constants)
    assert columns is not None
    assert edited.constants is not None
    after = dict(zip(edited.constants, columns.T, strict=True))
    before = dict(zip(cross.constants, cross.columns.T, strict=True))
    kept = {constant for constant in after if constant in before}
    assert all((after[constant] == before[constant]).all() for constant in kept)
    assert all((after[constant] == 0.0).all() for constant in after if constant not in kept)
    names = {constant[1] for constant in kept if constant[0] == "x"}  # type: ignore[index]
    assert names == {each.id for each in setup.reflectors.reflectors} - {"R3", "R4", "R7"}
    # A range bias and a clock stay what they are in a scanner that is turned.
    assert sum(constant[1] == "rear" for constant in kept) == 2  # type: ignore[index]
    assert sum(constant[1] == "scanner" for constant in kept) == 5  # type: ignore[index]


def test_columns_of_a_state_are_a_copy() -> None:
    rng = np.random.default_rng(5)
    setup = considered(random_map(rng, 4))
    drive = random_drive(setup, rng, Plan(scans=10, reach=30.0))
    cross = run(drive.log, setup, drive.initial).final.cross
    assert cross is not None
    columns = columns_of(cross, setup.constants)
    assert columns is not None
    columns[:] = 7.0
    assert not (cross.columns == 7.0).any()
    assert not cross.columns.flags.writeable
    assert cross_covariance(np.zeros((3, 2)), ("a", "b")) is None


def test_two_localizers_that_go_on_from_one_state_do_not_disturb_each_other() -> None:
    rng = np.random.default_rng(6)
    setup = considered(random_map(rng, 12))
    drive = random_drive(setup, rng, Plan(scans=60))
    records = list(drive.log.records())
    alone = Localizer(setup, drive.initial)
    for record in records[:60]:
        alone.feed(record)
    assert not alone.waiting
    twins = [Localizer(setup, alone.state) for _ in range(2)]
    given = alone.state.cross
    assert given is not None
    kept = given.columns.copy()
    for record in records[60:]:
        for each in (alone, *twins):
            each.feed(record)
    assert (given.columns == kept).all()
    assert twins[0].state == twins[1].state == alone.state
    assert alone.mode is Mode.OPERATIONAL
