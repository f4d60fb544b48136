"""Faults of what a layout promises: masks inverted, half a sigma, limits that are not asked, another one's survey."""

from tests.tools.mutants.mutant import Mutant

FOLDER, TESTS = "commission/planning/", "tests/planning/"

PLANNING = (
    Mutant(
        name="restricted route keeps the others",
        file=FOLDER + "route_prediction.py",
        find="stays = kept[planned.visible.indices]",
        replace="stays = ~kept[planned.visible.indices]",
        tests=(
            TESTS + "test_route_prediction.py::test_a_restricted_route_is_that_of_a_site_with_only_those_reflectors",
        ),
    ),
    Mutant(
        name="share of the limit without the bias",
        file=FOLDER + "route_prediction.py",
        find="np.hypot(bias[:, 0], bias[:, 1]) + self.position_two_sigma",
        replace="self.position_two_sigma",
        tests=(
            TESTS
            + "test_route_prediction.py::test_load_is_bias_and_two_sigma_as_a_share_of_the_limit_of_the_worst_axis",
        ),
    ),
    Mutant(
        name="share of the limit of one sigma",
        file=FOLDER + "route_prediction.py",
        find="bias[:, 1]) + self.position_two_sigma",
        replace="bias[:, 1]) + 0.5 * self.position_two_sigma",
        tests=(
            TESTS
            + "test_route_prediction.py::test_load_is_bias_and_two_sigma_as_a_share_of_the_limit_of_the_worst_axis",
        ),
    ),
    Mutant(
        name="predicted 2-sigma is one",
        file=FOLDER + "route_prediction.py",
        find="return 2.0 * np.sqrt(np.diagonal(self.covariances",
        replace="return 1.0 * np.sqrt(np.diagonal(self.covariances",
        tests=(
            TESTS
            + "test_route_prediction.py::test_load_is_bias_and_two_sigma_as_a_share_of_the_limit_of_the_worst_axis",
        ),
    ),
    Mutant(
        name="metre fails by the mode alone",
        file=FOLDER + "route_prediction.py",
        find="(self.limit_share > 1.0) | (self.modes == Mode.FAIL)",
        replace="self.modes == Mode.FAIL",
        tests=(
            TESTS
            + "test_route_prediction.py::test_a_metre_fails_where_the_load_is_above_one_or_the_supervisor_says_so",
        ),
    ),
    Mutant(
        name="station reached whichever way the vehicle looks",
        file=FOLDER + "route_prediction.py",
        find="(distance <= AT_STATION) & (turned < FACING_STATION)",
        replace="(distance <= AT_STATION)",
        tests=(TESTS + "test_route_prediction.py::test_a_station_is_reached_within_its_distance_and_looking_its_way",),
    ),
    Mutant(
        name="station reached from twice the distance",
        file=FOLDER + "route_prediction.py",
        find="distance <= AT_STATION",
        replace="distance <= 2.0 * AT_STATION",
        tests=(TESTS + "test_route_prediction.py::test_a_station_is_reached_within_its_distance_and_looking_its_way",),
    ),
    Mutant(
        name="every reflector is dirty",
        file=FOLDER + "route_prediction.py",
        find="reach[list(damage.dirty)] *= planned.options.dirty_range",
        replace="reach *= planned.options.dirty_range",
        tests=(TESTS + "test_route_prediction.py::test_a_dirty_reflector_is_seen_from_near_by_only",),
    ),
    Mutant(
        name="mistaken beyond the whole distance",
        file=FOLDER + "association_risk.py",
        find="-0.5 * d / g",
        replace="-1.0 * d / g",
        tests=(
            TESTS
            + "test_association_risk.py::test_probability_is_that_of_half_the_distance_in_the_reflectors_own_gate",
        ),
    ),
    Mutant(
        name="gate of the neighbor instead of the reflector's own",
        file=FOLDER + "association_risk.py",
        find="rows = sees[reflector]",
        replace="rows = sees[neighbor]",
        tests=(
            TESTS
            + "test_association_risk.py::test_probability_is_that_of_half_the_distance_in_the_reflectors_own_gate",
        ),
    ),
    Mutant(
        name="accuracy that a station requires is not asked",
        file="commission/planning/layout_limits.py",
        find="np.minimum(limits[scans, :2], station.required_accuracy)",
        replace="np.maximum(limits[scans, :2], station.required_accuracy)",
        tests=(TESTS + "test_placement.py::test_a_station_gets_the_accuracy_that_it_requires",),
    ),
    Mutant(
        name="limits hold only while nothing is broken",
        file="commission/planning/layout_limits.py",
        find="    if gone != NOTHING:\n        left[gone] = False",
        replace="    if gone == NOTHING:\n        left[gone] = False",
        tests=(TESTS + "test_placement.py::test_limits_hold_without_any_single_reflector_where_that_is_demanded",),
    ),
    Mutant(
        name="station met by the better of two figures",
        file=FOLDER + "station_accuracy.py",
        find="return max(self.two_sigma, self.error)",
        replace="return min(self.two_sigma, self.error)",
        tests=(TESTS + "test_station_accuracy.py::test_a_station_is_met_when_both_figures_keep_to_it",),
    ),
    Mutant(
        name="best moment at a station stands for all",
        file=FOLDER + "station_accuracy.py",
        find="float(prediction.two_sigma[scans, :2].max())",
        replace="float(prediction.two_sigma[scans, :2].min())",
        tests=(TESTS + "test_station_accuracy.py::test_the_worst_moment_at_a_station_and_the_worse_axis_count",),
    ),
    Mutant(
        name="ellipse of the worst heading for the best",
        file=FOLDER + "fix_ellipses.py",
        find="if options.heading is Heading.BEST",
        replace="if options.heading is Heading.WORST",
        tests=("tests/app/coverage/test_ellipses.py::test_an_ellipse_is_as_long_as_the_heatmap_says",),
    ),
)
