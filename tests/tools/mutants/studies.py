"""Faults of the studies: twice a limit, half a sigma, the wrong cycles, what a figure is the mean of."""

from tests.tools.mutants.mutant import Mutant

FOLDER, TESTS = "commission/studies/", "tests/studies/"

STUDIES = (
    Mutant(
        name="ranges that grow too fast laid on the map",
        file=FOLDER + "map_shape.py",
        find="by_rest[:, 0, -3], by_rest[:, 0, -2] = 1.0, distances",
        replace="by_rest[:, 0, -3], by_rest[:, 0, -2] = 1.0, 0.0",
        tests=(TESTS + "test_map_shape.py::test_ranges_that_grow_too_fast_are_not_laid_on_the_map",),
    ),
    Mutant(
        name="scans that are alike taken for independent",
        file=FOLDER + "map_shape.py",
        find="factor = (squares + STATED_VIEWS * worst) / (max(freedom, 0) + STATED_VIEWS)",
        replace="factor = 1.0",
        tests=(TESTS + "test_map_shape.py::test_errors_that_last_for_a_while_are_not_laid_on_the_map",),
    ),
    Mutant(
        name="a map that makes the vehicle lost is not looked at",
        file=FOLDER + "map_shape_told.py",
        find="LOST_SHARE = 0.2",
        replace="LOST_SHARE = 1.0",
        tests=(TESTS + "test_map_shape.py::test_a_map_that_makes_the_vehicle_lost_is_named_all_the_same",),
    ),
    Mutant(
        name="wrong while operational only beyond twice the limit",
        file=FOLDER + "metrics.py",
        find="operational & (distance > position_limit)",
        replace="operational & (distance > 2.0 * position_limit)",
        tests=(
            TESTS
            + "test_metrics.py::test_wrong_while_operational_are_errors_beyond_the_limit_that_nobody_is_warned_of",
            TESTS + "test_run.py::test_from_here_on_another_limit_decides_what_is_wrong_while_operational",
        ),
    ),
    Mutant(
        name="wrong while operational counted in fail mode",
        file=FOLDER + "metrics.py",
        find="operational & (distance > position_limit)",
        replace="~operational & (distance > position_limit)",
        tests=(
            TESTS
            + "test_metrics.py::test_wrong_while_operational_are_errors_beyond_the_limit_that_nobody_is_warned_of",
        ),
    ),
    Mutant(
        name="wrong while operational at the limit itself",
        file=FOLDER + "metrics.py",
        find="operational & (distance > position_limit)",
        replace="operational & (distance >= position_limit)",
        tests=(
            TESTS
            + "test_metrics.py::test_wrong_while_operational_are_errors_beyond_the_limit_that_nobody_is_warned_of",
        ),
    ),
    Mutant(
        name="wrong while operational by the limit of the heading",
        file=FOLDER + "run.py",
        find="limits_along(columns)[:, 0]",
        replace="limits_along(columns)[:, 1]",
        tests=(TESTS + "test_run.py::test_from_here_on_another_limit_decides_what_is_wrong_while_operational",),
    ),
    Mutant(
        name="error is reference minus estimate",
        file=FOLDER + "metrics.py",
        find="errors = means - references",
        replace="errors = references - means",
        tests=(TESTS + "test_metrics.py::test_heading_error_is_the_short_turn",),
    ),
    Mutant(
        name="ANEES of the position over three degrees of freedom",
        file=FOLDER + "metrics.py",
        find="_mean_of_known(position_nees) / 2.0",
        replace="_mean_of_known(position_nees) / 3.0",
        tests=(TESTS + "test_metrics.py::test_statistics_of_a_run_worked_out_by_hand",),
    ),
    Mutant(
        name="2-sigma of a run is one",
        file=FOLDER + "run.py",
        find="sigmas *= 2.0",
        replace="sigmas *= 1.0",
        tests=(TESTS + "test_run.py::test_every_curve_has_the_numbers_of_its_cycles",),
    ),
    Mutant(
        name="noise is proposed although the other half of the drive gets worse",
        file=FOLDER + "calibration_noise_verdicts.py",
        find="any(value < -LOSS * scatter for value, scatter in gains)",
        replace="all(value < -LOSS * scatter for value, scatter in gains)",
        tests=(TESTS + "test_calibration_noise.py::test_noise_of_a_quiet_half_is_worse_for_a_loud_one",),
    ),
    Mutant(
        name="largest NIS counts what the gate rejects",
        file=FOLDER + "tallies.py",
        find="if status[row] == INLIER:",
        replace="if status[row] != OUTLIER_DETECTOR:",
        tests=(
            TESTS + "test_run.py::test_every_curve_has_the_numbers_of_its_cycles",
            TESTS + "test_run.py::test_the_largest_nis_of_a_cycle_is_that_of_its_inliers_alone",
        ),
    ),
    Mutant(
        name="one sigma of the position within the limits",
        file=FOLDER + "coverage.py",
        find="2.0 * position",
        replace="1.0 * position",
        tests=(TESTS + "test_coverage.py::test_two_sigma_of_position_and_of_heading_are_held_against_the_limits",),
    ),
    Mutant(
        name="one sigma of the heading within the limits",
        file=FOLDER + "coverage.py",
        find="2.0 * heading",
        replace="1.0 * heading",
        tests=(TESTS + "test_coverage.py::test_two_sigma_of_position_and_of_heading_are_held_against_the_limits",),
    ),
    Mutant(
        name="vehicle that starts in reverse looks ahead",
        file=FOLDER + "start.py",
        find="math.pi if segment.direction is Direction.REVERSE else 0.0",
        replace="0.0",
        tests=(TESTS + "test_start.py::test_a_route_that_starts_in_reverse_has_the_vehicle_face_backward",),
    ),
    Mutant(
        name="the keys of studies forget supervisor, gate and odometry",
        file="commission/studies/inputs.py",
        find="if field.compare]",
        replace='if field.compare and field.name != "parameters"]',
        tests=(
            "tests/app/prediction/test_service.py::test_every_part_that_a_prediction_depends_on_predicts_anew",
            "tests/studies/test_inputs.py::test_whatever_edit_changes_a_result_changes_the_input",
        ),
    ),
    Mutant(
        name="coverage without a map forgets its routes",
        file="commission/studies/coverage.py",
        find="routes=project.routes if project.floor_map is None else ()",
        replace="routes=()",
        tests=("tests/studies/test_inputs.py::test_whatever_edit_changes_a_result_changes_the_input",),
    ),
    Mutant(
        name="drives of every study are planned without the project's supervisor",
        file=FOLDER + "drives.py",
        find="            parameters=project.parameters,\n",
        replace=(
            "            parameters=__import__('dataclasses').replace(\n"
            "                project.parameters, supervisor=type(project.parameters.supervisor)()),\n"
        ),
        tests=(TESTS + "test_inputs.py::test_whatever_edit_changes_a_result_changes_the_input",),
    ),
    Mutant(
        name="drives of every study are planned without the project's gate",
        file=FOLDER + "drives.py",
        find="            parameters=project.parameters,\n",
        replace=(
            "            parameters=__import__('dataclasses').replace(\n"
            "                project.parameters, association=type(project.parameters.association)()),\n"
        ),
        tests=(TESTS + "test_inputs.py::test_whatever_edit_changes_a_result_changes_the_input",),
    ),
    Mutant(
        name="drives of every study are planned without the project's odometry",
        file=FOLDER + "drives.py",
        find="            parameters=project.parameters,\n",
        replace=(
            "            parameters=__import__('dataclasses').replace(\n"
            "                project.parameters, odometry=type(project.parameters.odometry)()),\n"
        ),
        tests=(TESTS + "test_inputs.py::test_whatever_edit_changes_a_result_changes_the_input",),
    ),
    Mutant(
        name="a second without an accepted detection is blind",
        file="commission/studies/events.py",
        find="if lasts > BLIND_S:",
        replace="if lasts >= BLIND_S:",
        tests=("tests/studies/test_events.py::test_a_stretch_without_an_accepted_detection_is_blind_beyond_a_second",),
    ),
    Mutant(
        name="a jump is told by the position alone",
        file="commission/studies/events.py",
        find=" | (turned > JUMP_SHARE * limits[here, 1])",
        replace="",
        tests=("tests/studies/test_events.py::test_a_correction_is_a_jump_beyond_half_of_a_limit",),
    ),
    Mutant(
        name="innovations across the beam count to the right",
        file="commission/studies/reflector_figures.py",
        find="found[:, 1] * distances",
        replace="-found[:, 1] * distances",
        tests=("tests/studies/test_reflector_figures.py::test_every_figure_equals_a_plain_recount",),
    ),
    Mutant(
        name="reflectors are expected while they are covered",
        file="commission/studies/reflector_figures.py",
        find="if index not in models and not segment.covered and len",
        replace="if index not in models and len",
        tests=(
            "tests/studies/test_reflector_figures.py::"
            "test_nothing_is_expected_while_reflectors_are_covered_or_out_of_reach",
        ),
    ),
)
