"""Coverage: the lattice, tiles, and that a dragged reflector leaves no trace but its own."""

import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from commission.errors import JobCancelled
from commission.geometry.occupancy import OccupancyGrid
from commission.geometry.raycast import RayCaster
from commission.planning import coverage as coverage_module
from commission.planning.coverage import Lattice, LiveCoverage, coverage, lattice_of
from commission.planning.dilution import FixOptions, Heading, Measurement
from commission.planning.vehicle_fixes import fixes
from commission.planning.vehicle_visibility import VehicleVisibility
from commission.planning.visibility import VisibilityOptions, build_visibility, unpack
from commission.site.floor_map import OCCUPIED, FloorMap
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap
from commission.site.routes import Route, Segment
from commission.site.scanner import Scanner

# Off the corners of cells: on a border, rounding decides which cell a point is in.
LATTICE = Lattice(x=0.11, y=0.12, spacing=0.25, rows=40, columns=60)


def hall(seed: int, count: int = 70, scanners: tuple[Scanner, ...] = ()) -> VehicleVisibility:
    """A 15 m x 10 m hall with boxes; more than 64 reflectors, plates among them."""
    rng = np.random.default_rng(seed)
    occupied = np.zeros((200, 300), dtype=bool)
    for _ in range(12):
        row, column = rng.integers(0, 200), rng.integers(0, 300)
        occupied[row : row + rng.integers(2, 20), column : column + rng.integers(2, 20)] = True
    reflectors = tuple(
        Reflector(
            id=str(i),
            x=float(rng.uniform(0, 15)),
            y=float(rng.uniform(0, 10)),
            kind=ReflectorKind.FLAT if i % 5 == 0 else ReflectorKind.CYLINDER,
            heading=float(rng.uniform(-3, 3)),
        )
        for i in range(count)
    )
    scanner = Scanner(range=(0.05, 6.0), resolution_deg=0.1, mounting=(0.3, 0.1, 0.2))
    caster, chosen = RayCaster(OccupancyGrid(occupied, 0.05)), VisibilityOptions()
    return VehicleVisibility(
        tuple(build_visibility(ReflectorMap(reflectors), each, caster, chosen) for each in scanners or (scanner,))
    )


def anew(visible: VehicleVisibility, reflectors: ReflectorMap) -> VehicleVisibility:
    """The same scanners and walls, prepared from nothing."""
    return VehicleVisibility(
        tuple(build_visibility(reflectors, m.scanner, m.caster, m.options) for m in visible.models)
    )


def assert_same(first, second):
    """Equal to the last bit."""
    for name, one, other in zip(first.fixes._fields, first.fixes, second.fixes, strict=True):
        np.testing.assert_array_equal(one, other, err_msg=name)


OPTIONS = [
    FixOptions(blocked_per_m=0.02),
    FixOptions(heading=Heading.WORST, headings=5),
    FixOptions(measurement=Measurement.BEARING_ONLY, heading=Heading.GIVEN, given_heading=2.0),
    FixOptions(measurement=Measurement.RANGE_BEARING_PRIOR, heading=Heading.BEST, headings=3),
]


TWO = (
    Scanner(name="front left", range=(0.05, 6.0), resolution_deg=0.1, mounting=(0.5, 0.3, 0.8)),
    Scanner(name="rear right", range=(0.05, 5.0), resolution_deg=0.2, mounting=(-0.6, -0.3, -2.3)),
)


@pytest.mark.parametrize("scanners", [(), TWO], ids=["one scanner", "two scanners"])
@pytest.mark.parametrize("options", OPTIONS, ids=lambda o: f"{o.measurement}, {o.heading}")
def test_coverage_after_many_moves_equals_a_full_recomputation_bit_for_bit(options, scanners):
    model = hall(1, scanners=scanners)
    live = LiveCoverage(model, coverage(model, LATTICE, options))
    assert_same(live.coverage, coverage(model, LATTICE, options))
    rng = np.random.default_rng(2)
    for _ in range(8):
        index = int(rng.integers(0, len(live.reflectors)))
        place = rng.uniform([-3, -3], [18, 13])
        live.move(index, replace(live.reflectors.reflectors[index], x=float(place[0]), y=float(place[1])))
    assert_same(live.coverage, coverage(anew(model, live.reflectors), LATTICE, options))


def test_coverage_follows_a_reflector_that_grows_and_turns_into_a_plate():
    model = hall(3)
    live = LiveCoverage(model, coverage(model, LATTICE, FixOptions()))
    (scanner,) = model.scanners
    small = replace(scanner, resolution_deg=2.0, beam_width_deg=0.0, range=(0.05, 30.0), reflector_range=30.0)
    short_sighted = VehicleVisibility((build_visibility(model.reflectors, small, model.caster, model.options),))
    live = LiveCoverage(short_sighted, coverage(short_sighted, LATTICE, FixOptions()))
    for changes in ({"radius": 0.5}, {"kind": ReflectorKind.FLAT, "heading": 1.0}, {"sigma": 0.1}):
        live.move(4, replace(live.reflectors.reflectors[4], **changes))
        assert_same(live.coverage, coverage(anew(short_sighted, live.reflectors), LATTICE, FixOptions()))


def test_a_move_says_where_it_changed_something_and_leaves_the_model_alone():
    model = hall(4)
    live = LiveCoverage(model, coverage(model, LATTICE, FixOptions()))
    before = [np.copy(figure) for figure in live.coverage.fixes]
    x_before = model.models[0].targets.centers[3, 0]
    windows = live.move(3, replace(model.reflectors.reflectors[3], x=1.0, y=1.0))
    inside = np.zeros((LATTICE.rows, LATTICE.columns), dtype=bool)
    for window in windows:
        inside[window.first_row : window.last_row, window.first_column : window.last_column] = True
    for old, new in zip(before, live.coverage.fixes, strict=True):
        assert (old[~inside.ravel()] == new[~inside.ravel()]).all()
    assert not all(np.array_equal(old, new) for old, new in zip(before, live.coverage.fixes, strict=True))
    assert model.models[0].targets.centers[3, 0] == x_before


def test_a_reflector_dragged_off_the_floor_is_seen_from_nowhere():
    model = hall(5)
    live = LiveCoverage(model, coverage(model, LATTICE, FixOptions()))
    assert live.sees(66).any()
    live.move(66, replace(live.reflectors.reflectors[66], x=500.0))
    assert not live.sees(66).any()
    live.move(66, replace(live.reflectors.reflectors[66], x=-500.0))
    assert not live.sees(66).any()


def test_live_coverage_knows_who_sees_a_reflector():
    model = hall(6)
    live = LiveCoverage(model, coverage(model, LATTICE, FixOptions()))
    seen = unpack(model.models[0].visible(LATTICE.points()), 70)
    for reflector in (0, 63, 64, 69):
        assert (live.sees(reflector) == seen[:, reflector]).all()


@pytest.mark.parametrize("scanners", [(), TWO], ids=["one scanner", "two scanners"])
def test_tiles_do_not_show(monkeypatch, scanners):
    model, options = hall(7, scanners=scanners), FixOptions(blocked_per_m=0.01, heading=Heading.WORST, headings=3)
    whole = coverage(model, LATTICE, options)
    monkeypatch.setattr(coverage_module, "POINTS_PER_TILE", 7 * 60)
    assert len(coverage_module.tiles(LATTICE)) == 6
    assert_same(coverage(model, LATTICE, options), whole)


def test_coverage_is_that_of_its_points_and_its_images_have_the_lowest_row_first():
    model, options = hall(8), FixOptions(heading=Heading.GIVEN, given_heading=0.5)
    found = coverage(model, LATTICE, options)
    expected = fixes(model, [[LATTICE.x + 3 * 0.25, LATTICE.y + 2 * 0.25]], options)
    assert found.image("position_sigma")[2, 3] == expected.position_sigma[0]
    assert found.image("visible").shape == (40, 60)
    assert found.lattice.index_near(LATTICE.x + 3 * 0.25 + 0.1, LATTICE.y + 2 * 0.25 - 0.1) == 2 * 60 + 3
    assert found.lattice.index_near(-5.0, 0.0) is None


def test_points_in_walls_are_not_floor_and_see_nothing():
    model = hall(9)
    found = coverage(model, LATTICE, FixOptions())
    in_wall = model.caster.grid.is_occupied(LATTICE.points())
    assert in_wall.any()
    assert (found.floor == ~in_wall).all()
    # A reflector's own disc may reach the point: then the ray has arrived before it meets the wall.
    near = np.hypot(*(LATTICE.points()[:, np.newaxis] - model.reflectors.centers).transpose(2, 0, 1)).min(axis=1) < 0.1
    assert (found.fixes.visible[in_wall & ~near] == 0).all()


def test_lattice_covers_the_floor_map_with_squares():
    cells = np.full((100, 203), OCCUPIED, dtype=np.int8)
    lattice = lattice_of(Project(floor_map=FloorMap(cells, 0.1, (-2.0, 3.0, 0.0))), 0.5)
    assert lattice == Lattice(x=-1.75, y=3.25, spacing=0.5, rows=20, columns=41)


def test_lattice_without_a_map_covers_reflectors_and_routes():
    route = Route("r", (Segment(control_points=np.array([[0, 0], [0, 10], [20, 10], [20, 0]], dtype=float)),))
    lattice = lattice_of(Project(reflectors=ReflectorMap((Reflector(id="1", x=-3.0, y=2.0),)), routes=(route,)), 1.0)
    assert lattice == Lattice(x=-7.5, y=-4.5, spacing=1.0, rows=20, columns=33)
    assert len(lattice_of(Project())) > 0


def test_progress_can_cancel_the_computation():
    def stop(fraction: float, _what: str) -> None:
        if fraction > 0.0:
            raise JobCancelled("stopped")

    with pytest.raises(JobCancelled):
        coverage(hall(10), LATTICE, FixOptions(), stop)
    fractions: list[float] = []
    coverage(hall(10), LATTICE, FixOptions(), lambda fraction, _what: fractions.append(fraction))
    assert (fractions[0], fractions[-1]) == (0.0, 1.0)


def test_a_lattice_without_points_is_refused():
    with pytest.raises(ValueError, match="1 or more each way"):
        Lattice(x=0.0, y=0.0, spacing=0.25, rows=0, columns=5)
    with pytest.raises(ValueError, match="spacing"):
        Lattice(x=0.0, y=0.0, spacing=math.inf, rows=5, columns=5)


PEAK = """
import resource, sys
from commission.geometry.occupancy import OccupancyGrid
from commission.geometry.raycast import RayCaster
from commission.planning.coverage import Lattice, coverage
from commission.planning.dilution import FixOptions
from commission.planning.vehicle_visibility import VehicleVisibility
from commission.planning.visibility import VisibilityOptions, build_visibility
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.scanner import Scanner
import numpy as np
places = np.random.default_rng(0).uniform(0.0, 100.0, (200, 2))
reflectors = ReflectorMap(tuple(Reflector(id=str(i), x=x, y=y) for i, (x, y) in enumerate(places.tolist())))
grid = OccupancyGrid(np.zeros((200, 200), dtype=np.bool_), 0.5)
model = VehicleVisibility((build_visibility(reflectors, Scanner(), RayCaster(grid), VisibilityOptions()),))
coverage(model, Lattice(x=0.0, y=0.0, spacing=1.0, rows=4, columns=4), FixOptions())
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
rows = int(sys.argv[1])
coverage(model, Lattice(x=0.0, y=0.0, spacing=100.0 / 1000, rows=rows, columns=1000), FixOptions())
print(1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="ru_maxrss counts kilobytes on Linux only")
def test_memory_of_a_large_floor_is_a_hundred_bytes_a_point_and_one_tile():
    peaks = []
    for rows in (400, 1600):
        done = subprocess.run([sys.executable, "-c", PEAK, str(rows)], capture_output=True, text=True, check=True)
        peaks.append(int(done.stdout))
    # A tile of 131,072 points: 40 bytes each, and 8 for every 64 of the 200 reflectors; and what the allocator keeps.
    tile = coverage_module.POINTS_PER_TILE * (40 + 8 * 4)
    for rows, peak in zip((400, 1600), peaks, strict=True):
        assert peak < 110 * 1000 * rows + 2 * tile, (rows, peak)
