"""Faults of the site and its edits: what is locked, what moves along, limits of what attracts."""

from tests.tools.mutants.mutant import Mutant

FOLDER, TESTS = "commission/site/", "tests/site/"

SITE = (
    Mutant(
        name="plate mirrored by the axis once",
        file=FOLDER + "editing/reflectors.py",
        find="2.0 * axis.angle - reflector.heading",
        replace="axis.angle - reflector.heading",
        tests=(TESTS + "editing/test_reflectors.py::test_a_mirrored_plate_faces_the_mirrored_way",),
    ),
    Mutant(
        name="plate that is turned looks the old way",
        file=FOLDER + "editing/reflectors.py",
        find="r.heading + angle)",
        replace="r.heading)",
        tests=(
            TESTS
            + "editing/test_reflectors.py::test_a_plate_that_is_turned_about_a_pivot_moves_and_faces_the_turned_way",
        ),
    ),
    Mutant(
        name="locked reflectors are changed",
        file=FOLDER + "editing/reflectors.py",
        find="if r.id in chosen and not r.locked else r for",
        replace="if r.id in chosen else r for",
        tests=(TESTS + "editing/test_reflectors.py::test_edits_leave_locked_reflectors_and_the_rest_of_the_map_alone",),
    ),
    Mutant(
        name="copies of locked reflectors are locked",
        file=FOLDER + "editing/reflectors.py",
        find="replace(copy, id=name, locked=False)",
        replace="replace(copy, id=name)",
        tests=(
            TESTS
            + "editing/test_reflectors.py::test_an_array_has_each_copy_one_step_from_the_one_before_and_none_is_locked",
        ),
    ),
    Mutant(
        name="all copies of an array at the first place",
        file=FOLDER + "editing/reflectors.py",
        find="x=r.x + k * dx, y=r.y + k * dy",
        replace="x=r.x + dx, y=r.y + dy",
        tests=(
            TESTS
            + "editing/test_reflectors.py::test_an_array_has_each_copy_one_step_from_the_one_before_and_none_is_locked",
        ),
    ),
    Mutant(
        name="row loses its last point to rounding",
        file=FOLDER + "editing/reflectors.py",
        find="length / spacing + 1e-9",
        replace="length / spacing - 1e-9",
        tests=(TESTS + "editing/test_reflectors.py::test_a_row_reaches_its_end_when_the_spacing_fits",),
    ),
    Mutant(
        name="cylinder stands in the wall",
        file=FOLDER + "editing/snapping.py",
        find="depth = PLATE_DEPTH if is_flat else reflector.reckoned_radius",
        replace="depth = PLATE_DEPTH",
        tests=(
            TESTS
            + "editing/test_snapping.py::test_a_cylinder_touches_the_wall_and_a_plate_lies_on_it_and_faces_the_hall",
        ),
    ),
    Mutant(
        name="plate faces the wall",
        file=FOLDER + "editing/snapping.py",
        find="heading=wall.heading if is_flat",
        replace="heading=wall.heading + math.pi if is_flat",
        tests=(
            TESTS
            + "editing/test_snapping.py::test_a_cylinder_touches_the_wall_and_a_plate_lies_on_it_and_faces_the_hall",
        ),
    ),
    Mutant(
        name="locked reflectors snap to walls",
        file=FOLDER + "editing/snapping.py",
        find="frozenset(ids).difference(locked)",
        replace="frozenset(ids)",
        tests=(
            TESTS
            + "editing/test_snapping.py::test_a_cylinder_touches_the_wall_and_a_plate_lies_on_it_and_faces_the_hall",
        ),
    ),
    Mutant(
        name="reach of a wall in cells",
        file=FOLDER + "editing/snapping.py",
        find="if distances[best] * cell > reach",
        replace="if distances[best] > reach",
        tests=(
            TESTS + "editing/test_snapping.py::test_a_click_inside_a_wall_comes_out_at_its_surface",
            TESTS
            + "editing/test_snapping.py::test_a_cylinder_touches_the_wall_and_a_plate_lies_on_it_and_faces_the_hall",
        ),
    ),
    Mutant(
        name="wall of a turned map faces the way of the upright one",
        file=FOLDER + "editing/snapping.py",
        find="math.atan2(normal[1], normal[0]) + float(grid.origin[2])",
        replace="math.atan2(normal[1], normal[0])",
        tests=(TESTS + "editing/test_snapping.py::test_a_straight_wall_is_met_exactly_in_a_turned_grid_too",),
    ),
    Mutant(
        name="row attracts just short of its reach",
        file=FOLDER + "editing/snapping.py",
        find="gaps[best] <= reach",
        replace="gaps[best] < reach",
        tests=(TESTS + "editing/test_snapping.py::test_a_row_attracts_up_to_its_reach_and_not_beyond",),
    ),
    Mutant(
        name="plant turned onto the map",
        file=FOLDER + "editing/alignment.py",
        find="se2.compose(T_plant_map, floor_map.origin)",
        replace="se2.compose(floor_map.origin, T_plant_map)",
        tests=(TESTS + "editing/test_alignment.py::test_a_map_whose_origin_is_turned_already_is_turned_on_from_there",),
    ),
    Mutant(
        name="map turned the wrong way",
        file=FOLDER + "editing/alignment.py",
        find="math.atan2(in_plant[1], in_plant[0]) - math.atan2(on_map[1], on_map[0])",
        replace="math.atan2(on_map[1], on_map[0]) - math.atan2(in_plant[1], in_plant[0])",
        tests=(TESTS + "editing/test_alignment.py::test_both_points_land_where_they_lie_in_the_plant",),
    ),
    Mutant(
        name="map longer than the plant said as shorter",
        file=FOLDER + "editing/alignment.py",
        find="self.in_plant - self.on_map",
        replace="self.on_map - self.in_plant",
        tests=(
            TESTS + "editing/test_alignment.py::test_a_difference_of_distances_is_told_and_split_between_the_points",
        ),
    ),
    Mutant(
        name="stations stay when the map moves",
        file=FOLDER + "editing/alignment.py",
        find="stations=tuple(_station(station, T) for station in project.stations)",
        replace="stations=project.stations",
        tests=(TESTS + "editing/test_alignment.py::test_everything_that_was_placed_on_the_map_goes_with_it",),
    ),
    Mutant(
        name="points that miss by twice what no building has are taken",
        file=FOLDER + "editing/alignment.py",
        find="if alignment.share > WRONG",
        replace="if alignment.share > 2.0 * WRONG",
        tests=(TESTS + "editing/test_alignment.py::test_points_that_no_map_could_fit_are_refused",),
    ),
)
