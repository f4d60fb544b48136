"""Faults of the commands: radians told as degrees, degrees taken as radians, metres as millimetres."""

from tests.tools.mutants.mutant import Mutant

FOLDER, TESTS = "commission/cli/", "tests/cli/test_units.py::"

CLI = (
    Mutant(
        name="RMS of the heading told in radians",
        file=FOLDER + "localize.py",
        find="{PLAIN_DEGREES.text(errors.heading_rmse, '.2f')}",
        replace="{errors.heading_rmse:.2f} deg",
        tests=(TESTS + "test_localize_tells_millimetres_degrees_and_percent",),
    ),
    Mutant(
        name="largest error told as the one at 95 %",
        file=FOLDER + "localize.py",
        find="errors.position_p95, errors.position_max)",
        replace="errors.position_max, errors.position_max)",
        tests=(TESTS + "test_localize_tells_millimetres_degrees_and_percent",),
    ),
    Mutant(
        name="alarm limit told in metres",
        file=FOLDER + "localize.py",
        find="{MILLIMETRES.text(limit)}",
        replace="{limit:.0f} mm",
        tests=(TESTS + "test_localize_tells_millimetres_degrees_and_percent",),
    ),
    Mutant(
        name="heading of the start told in radians",
        file=FOLDER + "localize.py",
        find="{PLAIN_DEGREES.text(theta, '.1f')}",
        replace="{theta:.1f} deg",
        tests=(TESTS + "test_localize_tells_millimetres_degrees_and_percent",),
    ),
    Mutant(
        name="limit of the heading told in radians",
        file=FOLDER + "predict.py",
        find="(limit {PLAIN_DEGREES.number(limits.heading_limit, '.2f')})",
        replace="(limit {limits.heading_limit:.2f})",
        tests=(TESTS + "test_predict_tells_millimetres_and_degrees",),
    ),
    Mutant(
        name="predicted heading told in radians",
        file=FOLDER + "predict.py",
        find="heading {PLAIN_DEGREES.text(heading, '.2f')}",
        replace="heading {heading:.2f} deg",
        tests=(TESTS + "test_predict_tells_millimetres_and_degrees",),
    ),
    Mutant(
        name="error of the heading told in radians",
        file=FOLDER + "predict.py",
        find="{PLAIN_DEGREES.text(error_heading, '.2f')}",
        replace="{error_heading:.2f} deg",
        tests=(TESTS + "test_predict_tells_millimetres_and_degrees",),
    ),
    Mutant(
        name="heading of a coverage taken as radians",
        file=FOLDER + "coverage.py",
        find="math.radians(self.heading)",
        replace="self.heading",
        tests=(TESTS + "test_heading_of_a_coverage_is_given_in_degrees",),
    ),
    Mutant(
        name="heading of a fix told in radians",
        file=FOLDER + "coverage.py",
        find="{figure('heading_sigma_median_rad', PLAIN_DEGREES, '.2f')}",
        replace="{figure('heading_sigma_median_rad', BARE, '.2f')} deg",
        tests=(TESTS + "test_coverage_tells_millimetres_degrees_and_percent",),
    ),
    Mutant(
        name="limit of the heading of a layout taken as radians",
        file=FOLDER + "place.py",
        find="math.radians(self.heading_limit)",
        replace="self.heading_limit",
        tests=(TESTS + "test_headings_of_what_is_demanded_of_a_layout_are_given_in_degrees",),
    ),
    Mutant(
        name="heading of a spot taken as radians",
        file=FOLDER + "place.py",
        find="math.radians(heading[0])",
        replace="heading[0]",
        tests=(TESTS + "test_headings_of_what_is_demanded_of_a_layout_are_given_in_degrees",),
    ),
    Mutant(
        name="pose that looks like another one told in radians",
        file=FOLDER + "ambiguity.py",
        find="{PLAIN_DEGREES.text(heading)}",
        replace="{heading:.0f} deg",
        tests=(TESTS + "test_a_pose_is_told_in_metres_and_degrees",),
    ),
)
