"""Faults of the commands: radians told as degrees, degrees taken as radians, metres as millimetres."""

from tests.tools.mutants.mutant import Mutant

FOLDER, TESTS = "commission/cli/", "tests/cli/test_units.py::"

CLI = (
    Mutant(
        name="RMS of the heading told in radians",
        file=FOLDER + "localize.py",
        find="math.degrees(errors.heading_rmse)",
        replace="errors.heading_rmse",
        tests=(TESTS + "test_localize_tells_millimetres_degrees_and_percent",),
    ),
    Mutant(
        name="largest error told as the one at 95 %",
        file=FOLDER + "localize.py",
        find="{errors.position_p95 * 1e3:.1f} at 95 %",
        replace="{errors.position_max * 1e3:.1f} at 95 %",
        tests=(TESTS + "test_localize_tells_millimetres_degrees_and_percent",),
    ),
    Mutant(
        name="alarm limit told in metres",
        file=FOLDER + "localize.py",
        find="{limit * 1e3:.0f} mm",
        replace="{limit:.0f} mm",
        tests=(TESTS + "test_localize_tells_millimetres_degrees_and_percent",),
    ),
    Mutant(
        name="heading of the start told in radians",
        file=FOLDER + "localize.py",
        find="math.degrees(theta)",
        replace="theta",
        tests=(TESTS + "test_localize_tells_millimetres_degrees_and_percent",),
    ),
    Mutant(
        name="limit of the heading told in radians",
        file=FOLDER + "predict.py",
        find="math.degrees(limits.heading_limit)",
        replace="limits.heading_limit",
        tests=(TESTS + "test_predict_tells_millimetres_and_degrees",),
    ),
    Mutant(
        name="predicted heading told in radians",
        file=FOLDER + "predict.py",
        find="math.degrees(heading)",
        replace="heading",
        tests=(TESTS + "test_predict_tells_millimetres_and_degrees",),
    ),
    Mutant(
        name="true error of the heading told in radians",
        file=FOLDER + "predict.py",
        find="math.degrees(error_heading)",
        replace="error_heading",
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
        find="degrees = math.degrees(1.0)",
        replace="degrees = 1.0",
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
        find="{math.degrees(heading):.0f}",
        replace="{heading:.0f}",
        tests=(TESTS + "test_a_pose_is_told_in_metres_and_degrees",),
    ),
)
