"""Faults of the geometry: signs, wraps, series near zero, rows and columns."""

from tests.tools.mutants.mutant import Mutant

FOLDER, TESTS = "commission/geometry/", "tests/geometry/"

GEOMETRY = (
    Mutant(
        name="difference of two angles taken the other way",
        file=FOLDER + "angles.py",
        find="np.subtract(angle, reference)",
        replace="np.subtract(reference, angle)",
        tests=(TESTS + "test_angles.py::test_difference_takes_the_short_way_round",),
    ),
    Mutant(
        name="half a turn to the left is not that to the right",
        file=FOLDER + "angles.py",
        find="(given >= -math.pi) & (given < math.pi)",
        replace="(given >= -math.pi) & (given <= math.pi)",
        tests=(TESTS + "test_angles.py::test_ends_of_the_interval_are_one_angle",),
    ),
    Mutant(
        name="relative heading not wrapped",
        file=FOLDER + "se2.py",
        find="wrap(delta[..., 2])",
        replace="delta[..., 2]",
        tests=(TESTS + "test_se2.py::test_headings_stay_within_half_a_turn",),
    ),
    Mutant(
        name="heading of an inverse not wrapped",
        file=FOLDER + "se2.py",
        find="s * x - c * y, wrap_scalar(-t)",
        replace="s * x - c * y, -t",
        tests=(TESTS + "test_se2.py::test_headings_stay_within_half_a_turn",),
    ),
    Mutant(
        name="next term of the series of exp is half as large",
        file=FOLDER + "se2.py",
        find="w * (0.5 - w2 / 24.0), 2.0",
        replace="w * (0.5 - w2 / 48.0), 2.0",
        tests=(TESTS + "test_se2.py::test_series_near_zero_are_the_closed_forms_to_the_last_bits",),
    ),
    Mutant(
        name="next term of the series of exp is half as large in the kernel",
        file=FOLDER + "se2.py",
        find="across = w * (0.5 - w2 / 24.0)\n    else",
        replace="across = w * (0.5 - w2 / 48.0)\n    else",
        tests=(TESTS + "test_se2.py::test_series_near_zero_are_the_closed_forms_to_the_last_bits",),
    ),
    Mutant(
        name="axes of an ellipse from the whole difference of its variances",
        file=FOLDER + "gaussian.py",
        find="half_difference = 0.5 *",
        replace="half_difference = 1.0 *",
        tests=(TESTS + "test_gaussian.py::test_axes_agree_with_the_eigenvalue_solver_in_a_batch",),
    ),
    Mutant(
        name="ellipse lies across",
        file=FOLDER + "gaussian.py",
        find="np.arctan2(covariance_xy, half_difference)",
        replace="np.arctan2(half_difference, covariance_xy)",
        tests=(
            TESTS + "test_gaussian.py::test_axes_return_the_sigmas_and_angle_that_made_the_covariance",
            TESTS + "test_gaussian.py::test_outline_lies_at_the_mahalanobis_distance_it_was_drawn_for",
        ),
    ),
    Mutant(
        name="outline goes round twice",
        file=FOLDER + "gaussian.py",
        find="(2.0 * math.pi / n)",
        replace="(4.0 * math.pi / n)",
        tests=(
            TESTS + "test_gaussian.py::test_outline_goes_round_once_counterclockwise_from_the_end_of_the_longer_axis",
        ),
    ),
    Mutant(
        name="cells as column and row",
        file=FOLDER + "occupancy.py",
        find=".astype(np.int64)[..., ::-1]",
        replace=".astype(np.int64)",
        tests=(TESTS + "test_occupancy.py::test_center_of_a_cell_lies_in_that_cell",),
    ),
    Mutant(
        name="center of a cell at its corner",
        file=FOLDER + "occupancy.py",
        find="[..., ::-1] + 0.5)",
        replace="[..., ::-1] + 0.0)",
        tests=(TESTS + "test_occupancy.py::test_center_of_a_cell_lies_in_that_cell",),
    ),
    Mutant(
        name="curve to the left has negative curvature",
        file=FOLDER + "splines.py",
        find="dx / safe * ddy - dy / safe * ddx",
        replace="dy / safe * ddx - dx / safe * ddy",
        tests=(TESTS + "test_splines.py::test_nurbs_circle_is_exact",),
    ),
    Mutant(
        name="tangent leans to the longer chord",
        file=FOLDER + "splines.py",
        find="before * step_after + after * step_before",
        replace="before * step_before + after * step_after",
        tests=(TESTS + "test_splines.py::test_catmull_rom_is_the_curve_of_barry_and_goldman",),
    ),
)
