"""Faults of the estimators: powers and factors, signs, limits, the frame and the wrap of an angle, what is kept."""

from tests.tools.mutants.mutant import Mutant

FOLDER, TESTS = "commission/localization/", "tests/localization/"
PLAIN = TESTS + "test_localizer.py::test_localizer_agrees_with_the_plain_one"
TIE = TESTS + "test_association.py::test_of_two_close_reflectors_the_likelier_one_is_taken_on_either_side_of_the_tie"
BY_HAND = (
    "test_observation.py::test_drawn_gate_of_an_exact_pose_is_the_noise_of_range_bearing_and_survey_laid_on_the_floor"
)
OUTLINE = "test_observation.py::test_drawn_outline_of_the_gate_parts_what_the_localizer_takes_from_what_it_leaves"
RADIUS = "test_association.py::test_radius_that_is_searched_is_no_larger_than_it_must_be_along_a_ray_and_across_it"
VIEWPOINT = "test_association.py::test_viewpoint_is_the_place_of_the_scanner_and_its_longest_sigma"
RECOVERY = "test_supervisor.py::test_recovers_only_when_every_two_sigma_is_below_its_limit_divided_by_the_ratio"

PROTECTION = TESTS + "test_protection_mode.py::"
TEXTBOOK = PROTECTION + "test_the_level_is_that_of_textbook_filters_and_the_mode_follows_it"

CONTRADICTS = TESTS + "test_trail.py::test_a_pose_contradicts_the_reflectors_that_what_it_sees_of_them_lies_beside"

LED = TESTS + "test_trail.py::test_a_pose_is_led_along_as_a_plain_filter_with_matrices_leads_it"

SEVERAL = TESTS + "test_several_scans.py::"

LOCALIZATION = (
    Mutant(
        name="one of four that stands elsewhere keeps a vehicle from being found",
        file="commission/localization/trail_search.py",
        find="AFTER_ALL_S = 5.0",
        replace="AFTER_ALL_S = 5000.0",
        tests=(
            "tests/acceptance/test_wrong_maps.py::test_where_one_of_four_stands_elsewhere_the_vehicle_is_found_by_the_others_and_says_which",
        ),
    ),
    Mutant(
        name="a deep beam in the middle of a cluster draws its center aside",
        file=FOLDER + "clusters.py",
        find="abs(ranges[high] - ranges[middle]) <= deep",
        replace="ranges[high] - ranges[middle] <= deep",
        tests=(TESTS + "test_detector.py::test_no_center_lies_beside_its_beams_whatever_bright_things_stand_behind",),
    ),
    Mutant(
        name="what a frame believed by itself is handed out though a tag tells another place",
        file=FOLDER + "tag_start.py",
        find="output=before.tracking.output,",
        replace="output=after.tracking.output,",
        tests=(
            TESTS + "test_tags.py::"
            "test_what_a_frame_believed_by_itself_is_not_handed_out_once_a_tag_tells_another_place",
        ),
    ),
    Mutant(
        name="a match of contours is held by the far face of a thin wall",
        file=FOLDER + "contour_match.py",
        find="comes_through = before < d",
        replace="comes_through = before > d",
        tests=(TESTS + "test_contour_match.py::test_the_far_face_of_a_thin_wall_holds_no_match",),
    ),
    Mutant(
        name="walls are matched as drawn, however deep they are known to be",
        file=FOLDER + "wall_depth.py",
        find="tables.theta, depth)",
        replace="tables.theta, 0.0)",
        tests=(TESTS + "test_wall_depth.py::test_a_scan_is_matched_with_walls_as_deep_as_they_are_known_to_be",),
    ),
    Mutant(
        name="the depth of walls is learned again from every scan of a vehicle that stands",
        file=FOLDER + "wall_depth.py",
        find="min(moved / NEW_WALLS_AFTER, 1.0)",
        replace="1.0",
        tests=(TESTS + "test_wall_depth.py::test_a_vehicle_that_stands_learns_from_its_first_scan_alone",),
    ),
    Mutant(
        name="a bearing that fits nothing speaks against the pose also where no reflector is missing",
        file=FOLDER + "bearing_cycle.py",
        find="return missing / max(within, 1.0)",
        replace="return 1.0",
        tests=(TESTS + "test_bearings.py::test_things_that_the_map_lacks_beside_reflectors_that_are_met_lose_nobody",),
    ),
    Mutant(
        name="poses that go along are carried in the direction in which the run's own one drives",
        file=FOLDER + "several_scans.py",
        find="direction_of(rival.theta - before[2])",
        replace="direction_of(0.0)",
        tests=(SEVERAL + "test_poses_are_those_of_plain_hypotheses",),
    ),
    Mutant(
        name="a vehicle drives by its pose where it may as well stand elsewhere",
        file=FOLDER + "several_scans.py",
        find="elsewhere > DOUBT * whole",
        replace="elsewhere > 2.0 * whole",
        tests=(SEVERAL + "test_what_a_scan_cannot_tell_the_next_ones_decide",),
    ),
    Mutant(
        name="a filter that leaves a reflector out is corrected by it",
        file=FOLDER + "protection.py",
        find="bank.owner[slot] < 0 or bank.owner[slot] == number",
        replace="bank.owner[slot] < 0 or bank.owner[slot] == number + 1",
        tests=(
            TEXTBOOK,
            PROTECTION + "test_four_reflectors_around_a_vehicle_at_rest_give_the_level_of_the_closed_form",
        ),
    ),
    Mutant(
        name="where the supervisor goes by protection levels, 2-sigma still decides",
        file=FOLDER + "protected_cycle.py",
        find="judge(before.mode, found.position, found.heading, model.limits)",
        replace="after.mode",
        tests=(TEXTBOOK,),
    ),
    Mutant(
        name="filters of the protection level outlive that the vehicle is lost",
        file=FOLDER + "protected_cycle.py",
        find="        forget(protected.bank)\n",
        replace="",
        tests=(PROTECTION + "test_live_is_the_whole_run_to_the_last_bit",),
    ),
    Mutant(
        name="a thing that stands beside a wrong pose's reflector speaks for it again and again",
        file=FOLDER + "trail_fit.py",
        find="evidence += min(gains[entry], bound)",
        replace="evidence += gains[entry]",
        tests=(LED,),
    ),
    Mutant(
        name="what is seen of a reflector on average is as noisy as a single detection",
        file=FOLDER + "contradiction.py",
        find="met[:, k] / weight**2",
        replace="met[:, k] / weight",
        tests=(CONTRADICTS,),
    ),
    Mutant(
        name="a pose contradicts reflectors that stand where it says within what the supervisor allows",
        file=FOLDER + "contradiction.py",
        find=" & (np.hypot(x, y) > around.harmless)",
        replace="",
        tests=(CONTRADICTS,),
    ),
    Mutant(
        name="a hypothesis is believed that contradicts every reflector",
        file=FOLDER + "trail_search.py",
        find="MOST_CONTRADICTED = 1.0 / 3.0",
        replace="MOST_CONTRADICTED = 1.0",
        tests=(
            "tests/cli/test_localize_found.py"
            "::test_a_moved_reflector_pulls_nobody_beside_the_place_that_the_others_tell",
        ),
    ),
    Mutant(
        name="things that scatter more than stated tell a pose as surely",
        file=FOLDER + "hypothesis_fit.py",
        find="misfit += d2",
        replace="misfit += 0.0",
        tests=(TESTS + "test_start.py::test_things_that_scatter_more_than_stated_tell_a_pose_less_surely",),
    ),
    Mutant(
        name="a trail keeps all of the way, however long ago it was seen",
        file=FOLDER + "trail.py",
        find="and to_come < LONGEST_WAY",
        replace="",
        tests=(TESTS + "test_trail.py::test_a_trail_keeps_the_newest_of_the_way_and_no_scan_that_saw_nothing",),
    ),
    Mutant(
        name="a scanner with a wide field of view sees as if it were a narrow one",
        file=FOLDER + "trail_fit.py",
        find="(behind_first or before_end or is_round)",
        replace="(behind_first and before_end)",
        tests=(
            TESTS + "test_trail.py::test_reflectors_in_view_are_those_whose_bearing_and_range_are_within_the_limits",
        ),
    ),
    Mutant(
        name="poses that are alike are each led along",
        file=FOLDER + "hypotheses.py",
        find="turn < part * SAME_HEADING",
        replace="turn < SAME_HEADING",
        tests=(TESTS + "test_trail.py::test_poses_of_one_place_are_led_along_once_the_likeliest_of_them",),
    ),
    Mutant(
        name="a vehicle at rest takes every scan of a trail for a new one",
        file=FOLDER + "trail_fit.py",
        find="1.0 / max(counts, LEAST_COUNTED)",
        replace="1.0",
        tests=(LED,),
    ),
    Mutant(
        name="a detection of two reflectors tells a pose as surely as one of one",
        file=FOLDER + "trail_fit.py",
        find="(work[r, 3] + dx * dx)",
        replace="work[r, 3]",
        tests=(LED,),
    ),
    Mutant(
        name="a shiny thing speaks against a pose again and again",
        file=FOLDER + "trail_fit.py",
        find="max(strange[at, 2], LEAST_OF_ONE)",
        replace="strange[at, 2]",
        tests=(LED,),
    ),
    Mutant(
        name="a pose that was found among things beside their places is as sure as any",
        file=FOLDER + "trail_search.py",
        find="+= found.misfit",
        replace="+= 0.0",
        tests=(TESTS + "test_trail.py::test_a_pose_found_among_things_beside_their_places_is_less_sure",),
    ),
    Mutant(
        name="bearings that are off by what the supervisor allows stop the vehicle",
        file=FOLDER + "lasting.py",
        find="return not harmless and found > share * limit",
        replace="return found > share * limit",
        tests=(
            TESTS + "test_bearings.py"
            "::test_innovations_that_average_out_stop_nobody_and_those_that_are_harmless_neither",
        ),
    ),
    Mutant(
        name="a beam that goes through a wall counts as one that ends at it",
        file=FOLDER + "wall_evidence.py",
        find="farthest < length - AT_WALL",
        replace="farthest < length - 100.0",
        tests=(TESTS + "test_wall_evidence.py::test_a_beam_counts_by_the_wall_it_ends_at_before_or_behind",),
    ),
    Mutant(
        name="walls speak without limit against that the vehicle is nowhere on the map",
        file=FOLDER + "hypotheses.py",
        find="none = float(hypotheses[np.argmax(hypotheses[:, 9]), 12])",
        replace="none = 0.0",
        tests=(
            TESTS + "test_wall_evidence.py::test_walls_speak_more_for_one_place_of_several_than_against_none_of_them",
        ),
    ),
    Mutant(
        name="likelihood with half of ln det S",
        file=FOLDER + "association.py",
        find="d2 + math.log(spread)",
        replace="d2 + 0.5 * math.log(spread)",
        tests=(PLAIN, TIE),
    ),
    Mutant(
        name="likelihood without ln det S, as if all reflectors were surveyed alike",
        file=FOLDER + "association.py",
        find="d2 + math.log(spread)",
        replace="d2",
        tests=(PLAIN, TIE),
    ),
    Mutant(
        name="gate of one degree of freedom",
        file=FOLDER + "association.py",
        find="chi_square_gate(probability, 2), kind",
        replace="chi_square_gate(probability, 1), kind",
        tests=(TESTS + "test_association.py::test_gate_of_the_parameters_is_that_of_two_degrees_of_freedom", PLAIN),
    ),
    Mutant(
        name="range bias added instead of taken off before association",
        file=FOLDER + "association.py",
        find="measured[i, 0] - model.range_bias",
        replace="measured[i, 0] + model.range_bias",
        tests=(PLAIN,),
    ),
    Mutant(
        name="the later of two equal claims of one reflector stays",
        file=FOLDER + "association.py",
        find="d2[other] <= best_d2",
        replace="d2[other] < best_d2",
        tests=(TESTS + "test_association.py::test_of_two_detections_that_are_equally_near_the_first_stays",),
    ),
    Mutant(
        name="search around a detection forgets the survey",
        file=FOLDER + "search.py",
        find="model.range_variance + largest_variance",
        replace="model.range_variance - largest_variance",
        tests=(TESTS + RADIUS,),
    ),
    Mutant(
        name="search goes on only where it need not",
        file=FOLDER + "association.py",
        find="if best != NOBODY:\n            # ln",
        replace="if best == NOBODY:\n            # ln",
        tests=(TESTS + "test_association.py::test_nearby_search_equals_a_plain_search_over_all_reflectors",),
    ),
    Mutant(
        name="lever of the scanner turned the wrong way",
        file=FOLDER + "search.py",
        find="belief.xx - 2.0 * offset_y * belief.xt",
        replace="belief.xx + 2.0 * offset_y * belief.xt",
        tests=(TESTS + VIEWPOINT,),
    ),
    Mutant(
        name="longest axis of the scanner's place from the whole difference of its variances",
        file=FOLDER + "pose_gaussian.py",
        find="half_difference = 0.5 *",
        replace="half_difference = 1.0 *",
        tests=(TESTS + VIEWPOINT,),
    ),
    Mutant(
        name="drawn gate spreads the survey's sigma over the bearing as sigma / r",
        file=FOLDER + "observation.py",
        find="surveyed / np.square(distance)",
        replace="surveyed / distance",
        tests=(TESTS + BY_HAND, TESTS + OUTLINE),
    ),
    Mutant(
        name="drawn gate without the survey in the range",
        file=FOLDER + "observation.py",
        find="model.range_variance + surveyed\n",
        replace="model.range_variance\n",
        tests=(TESTS + BY_HAND,),
    ),
    Mutant(
        name="drawn gate mirrored about the ray",
        file=FOLDER + "observation.py",
        find="np.stack((uy, delta[:, 0]), axis=1)",
        replace="np.stack((uy, -delta[:, 0]), axis=1)",
        tests=(TESTS + OUTLINE,),
    ),
    Mutant(
        name="drawn gate of the gate's square",
        file="commission/localization/validation.py",
        find="setup.filter.gate.d2**0.5",
        replace="setup.filter.gate.d2",
        tests=(TESTS + OUTLINE,),
    ),
    Mutant(
        name="a scanner's own noise forgotten by the filter",
        file=FOLDER + "observation.py",
        find="scanner.detection_sigmas(parameters.range_sigma, parameters.bearing_sigma)",
        replace="(parameters.range_sigma, parameters.bearing_sigma)",
        tests=("tests/studies/test_own_noise.py::test_a_prediction_takes_each_scanners_own_noise",),
    ),
    Mutant(
        name="bearing's sigma taken for its variance",
        file=FOLDER + "observation.py",
        find="bearing_sigma**2, float",
        replace="bearing_sigma, float",
        tests=(TESTS + "test_observation.py::test_kernels_are_given_the_mounting_and_the_variances_of_the_parameters",),
    ),
    Mutant(
        name="expected bearing not wrapped",
        file=FOLDER + "observation.py",
        find="wrap_scalar(math.atan2(dy, dx) - theta - mount)",
        replace="math.atan2(dy, dx) - theta - mount",
        tests=(TESTS + "test_observation.py::test_kernel_agrees_with_the_array_functions",),
    ),
    Mutant(
        name="lever of the scanner with the wrong sign in the Jacobian of the bearing",
        file=FOLDER + "observation.py",
        find="-(uy * offset_y + ux * offset_x) * inverse - 1.0",
        replace="(uy * offset_y + ux * offset_x) * inverse - 1.0",
        tests=(TESTS + "test_observation.py::test_kernel_agrees_with_the_array_functions", PLAIN),
    ),
    Mutant(
        name="bearing of an innovation turned the other way",
        file=FOLDER + "kalman.py",
        find="turn = turn_to(",
        replace="turn = -turn_to(",
        tests=(PLAIN,),
    ),
    Mutant(
        name="survey's variance left out of R when a bearing corrects",
        file=FOLDER + "kalman.py",
        find="model.bearing_variance + surveyed_variance * (",
        replace="model.bearing_variance + 0.0 * surveyed_variance * (",
        tests=(PLAIN, TIE),
    ),
    Mutant(
        name="every correction starts from the prediction, as Algorithm 1 is printed",
        file=FOLDER + "cycle.py",
        find="gate.kind, belief, facing, distance, aim, x, y, variance, observation, None",
        replace="gate.kind, prior, facing, distance, aim, x, y, variance, observation, None",
        tests=(PLAIN,),
    ),
    Mutant(
        name="supervisor fails on one sigma of y",
        file=FOLDER + "supervisor.py",
        find="2.0 * math.sqrt(variance)",
        replace="1.0 * math.sqrt(variance)",
        tests=(TESTS + "test_supervisor.py::test_each_two_sigma_above_its_limit_fails",),
    ),
    Mutant(
        name="supervisor recovers at the limit at which it failed",
        file=FOLDER + "supervisor.py",
        find="limits.position / limits.recovery_ratio, limits.heading / limits.recovery_ratio",
        replace="limits.position, limits.heading",
        tests=(TESTS + RECOVERY,),
    ),
    Mutant(
        name="heading's lever spread as if all its error arose halfway",
        file=FOLDER + "odometry.py",
        find="xx += heading * my * my / 3.0",
        replace="xx += heading * my * my / 4.0",
        tests=(TESTS + "test_odometry.py::test_straight_motion_split_anyhow_gives_the_same_belief",),
    ),
    Mutant(
        name="motion anticipated before a scan is driven a second time",
        file=FOLDER + "odometry.py",
        find="if motion.belief_ns != motion.odometry_ns:",
        replace="if motion.belief_ns == motion.odometry_ns:",
        tests=(TESTS + "test_odometry.py::test_scans_between_odometry_change_nothing_of_a_steady_motion", PLAIN),
    ),
    Mutant(
        name="cluster of a full turn cut where the turn begins",
        file=FOLDER + "detector_model.py",
        find="once * steps > TURN - 0.5 * steps",
        replace="once * steps > TURN + 0.5 * steps",
        tests=(TESTS + "test_detector.py::test_post_is_found_where_it_stands_at_any_bearing_of_a_full_turn",),
    ),
    Mutant(
        name="window of beams the other way round",
        file=FOLDER + "detector_model.py",
        find="int(parameters.min_model_error),\n        int(parameters.max_model_error)",
        replace="int(parameters.max_model_error),\n        int(parameters.min_model_error)",
        tests=(TESTS + "test_detector.py::test_detector_filter_is_a_window_around_the_expected_beams",),
    ),
    Mutant(
        name="a beam's aperture taken for half of it",
        file=FOLDER + "detector_model.py",
        find="0.5 * scanner.beam_aperture",
        replace="scanner.beam_aperture",
        tests=(TESTS + "test_beam_window.py::test_most_beams_of_a_post_are_those_that_touch_it",),
    ),
    Mutant(
        name="most beams are those of half a beam",
        file=FOLDER + "beam_window.py",
        find="flagged_span(wide, half_width, TOUCH)",
        replace="flagged_span(wide, half_width, MIDDLE)",
        tests=(TESTS + "test_beam_window.py::test_nearly_all_true_clusters_pass_however_wide_the_beams",),
    ),
    Mutant(
        name="dark beams bridged however wide the body",
        file=FOLDER + "clusters.py",
        find="return rule.widest / distance",
        replace="return 10.0 * rule.widest / distance",
        tests=(
            TESTS
            + "test_detector.py::test_dark_beams_at_the_range_of_a_body_are_bridged_up_to_the_width_of_a_reflector",
        ),
    ),
    Mutant(
        name="central beam without the radius behind it",
        file=FOLDER + "reflector_center.py",
        find="return distance + radius, angle_min",
        replace="return distance, angle_min",
        tests=(TESTS + "test_detector.py::test_central_beam_is_the_papers_rule",),
    ),
    Mutant(
        name="fitted circle pulled away from the post by what it learns of the bearing",
        file=FOLDER + "reflector_center.py",
        find="n_rt -= weight * echo.slope",
        replace="n_rt += weight * echo.slope",
        tests=(TESTS + "test_detector.py::test_bound_of_a_center_holds_for_all_of_4000_posts_and_is_nearly_reached",),
    ),
    Mutant(
        name="reflector handed out by its row in the cells instead of in the map",
        file=FOLDER + "cycle.py",
        find="rows.entries[i] = int(index.places[rows.entries[i], 3])",
        replace="rows.entries[i] = int(rows.entries[i])",
        tests=(PLAIN,),
    ),
    Mutant(
        name="output of a fail episode is the newest pose",
        file=FOLDER + "cycle.py",
        find="if mode == OPERATIONAL:",
        replace="if mode >= OPERATIONAL:",
        tests=(
            TESTS + "test_whole_run.py::test_withheld_output_of_a_whole_run_is_that_of_the_live_localizer",
            TESTS + "test_localizer.py::test_output_is_withheld_in_fail_mode_while_the_filter_goes_on",
        ),
    ),
    Mutant(
        name="output of a fail episode is that of its first operational cycle",
        file=FOLDER + "run_columns.py",
        find="back = int(np.argmax(operational))",
        replace="back = int(np.argmax(operational[::-1]))",
        tests=(TESTS + "test_whole_run.py::test_withheld_output_of_a_whole_run_is_that_of_the_live_localizer",),
    ),
    Mutant(
        name="wheels of a differential vehicle half as far apart when it turns",
        file=FOLDER + "kinematics.py",
        find="half = 0.5 * vehicle.wheel_separation",
        replace="half = 0.25 * vehicle.wheel_separation",
        tests=(TESTS + "test_kinematics.py::test_differential_and_tricycle_wheels_give_back_the_twist",),
    ),
    Mutant(
        name="scan against the pose though it accepts as many as it rejects",
        file=FOLDER + "rejection.py",
        find="accepted > MOST_FOR * rejected",
        replace="accepted > rejected",
        tests=(TESTS + "test_rejection.py::test_a_scan_speaks_against_the_pose_by_what_it_rejects",),
    ),
    Mutant(
        name="a turn that excuses along the line of sight",
        file=FOLDER + "rejection.py",
        find="along = max(abs(ex * to_x + ey * to_y) - NOISE",
        replace="along = max(abs(ex * to_x + ey * to_y) - rule.harmless_turn * distance - NOISE",
        tests=(TESTS + "test_rejection.py::test_no_turn_excuses_what_is_off_along_the_line_of_sight",),
    ),
    Mutant(
        name="each rejected detection is excused alone, whatever several tell together",
        file=FOLDER + "rejection.py",
        find="return Counted(accepted, rejected + told, near + told)",
        replace="return Counted(accepted, rejected, near)",
        tests=(TESTS + "test_rejection.py::test_several_that_tell_of_one_displacement_count_though_each_is_harmless",),
    ),
    Mutant(
        name="several detections of one reflector tell of a displacement",
        file=FOLDER + "rejection.py",
        find="if entry != before:",
        replace="if True:",
        tests=(TESTS + "test_rejection.py::test_three_things_beside_one_reflector_tell_of_no_displacement",),
    ),
    Mutant(
        name="a displacement that turns the other way",
        file=FOLDER + "displacement.py",
        find="pairs.turn + w * (qx * ey - qy * ex)",
        replace="pairs.turn + w * (qy * ex - qx * ey)",
        tests=(TESTS + "test_displacement.py::test_it_is_least_squares_with_a_prior",),
    ),
    Mutant(
        name="a range without noise",
        file=FOLDER + "rejection.py",
        find="NOISE = 3.0",
        replace="NOISE = 2.5",
        tests=(TESTS + "test_rejection.py::test_no_turn_excuses_what_is_off_along_the_line_of_sight",),
    ),
    Mutant(
        name="lost by one scan too many against the pose",
        file=FOLDER + "rejection.py",
        find="evidence.against >= rule.scans_against",
        replace="evidence.against > rule.scans_against",
        tests=(TESTS + "test_rejection.py::test_vehicle_is_lost_by_scans_in_a_row_that_reject_nearly_all",),
    ),
    Mutant(
        name="a bearing's mounting that turns the other way",
        file=FOLDER + "bearings.py",
        find="j.mount_xb, j.mount_yb, -1.0, 0.0, j.clock_b",
        replace="j.mount_xb, j.mount_yb, 1.0, 0.0, j.clock_b",
        tests=(
            TESTS + "test_bearings.py::test_a_row_is_the_derivative_of_the_expected_bearing_also_by_what_is_considered",
        ),
    ),
    Mutant(
        name="bearings that were off once are never forgotten",
        file=FOLDER + "lasting.py",
        find="kept = math.exp(-(seconds - row[SEEN]) / rule.window_s) if",
        replace="kept = 1.0 if",
        tests=(
            TESTS + "test_lasting.py::test_older_bearings_count_less_by_the_time_that_has_passed",
            TESTS + "test_lasting.py::test_a_reflector_that_is_back_in_its_place_is_forgotten_after_some_windows",
        ),
    ),
    Mutant(
        name="noise of a mean innovation that grows with its weights and not with their squares",
        file=FOLDER + "lasting.py",
        find="kept * kept * row[NOISE] + counts * counts *",
        replace="kept * row[NOISE] + counts *",
        tests=(
            TESTS + "test_bearings.py::test_innovations_that_do_not_average_out_stop_the_vehicle_as_their_mean_says",
        ),
    ),
    Mutant(
        name="a vehicle drives on while its bearings disagree",
        file=FOLDER + "cycle.py",
        find="evidence.confirmed < model.rejection.confirmations or evidence.lasting:",
        replace="evidence.confirmed < model.rejection.confirmations:",
        tests=(
            TESTS + "test_bearings.py::test_innovations_that_do_not_average_out_stop_the_vehicle_as_their_mean_says",
        ),
    ),
    Mutant(
        name="a bearing is of the likelier one of two reflectors that fit",
        file=FOLDER + "bearings.py",
        find="    if inside > 1:",
        replace="    if inside > 2:",
        tests=(TESTS + "test_bearings.py::test_a_bearing_without_a_name_is_of_the_only_reflector_that_fits",),
    ),
)
