"""Faults of the virtual world: noise in the wrong unit or direction, what hides what, when a fault begins and ends."""

from tests.tools.mutants.mutant import Mutant

FOLDER, TESTS = "commission/simulation/", "tests/simulation/"

SIMULATION = (
    Mutant(
        name="reflectors seen as seldom as the rates say of the others",
        file=FOLDER + "scan.py",
        find="rng.random(count) < detection_rate",
        replace="rng.random(count) > detection_rate",
        tests=(
            TESTS
            + "test_detection_rates.py::test_reflectors_are_seen_as_often_as_the_table_says_each_by_its_own_chance",
        ),
    ),
    Mutant(
        name="tape as dull as a wall at a slant",
        file=FOLDER + "echo_intensity.py",
        find="light.tape * cosine**light.tape_exponent",
        replace="light.tape * cosine",
        tests=(TESTS + "test_intensities.py::test_tape_fades_with_the_power_of_the_cosine_of_the_incidence",),
    ),
    Mutant(
        name="mixed beam in the middle whatever the light",
        file=FOLDER + "echo_intensity.py",
        find="moment += strengths[k] * distances[k]",
        replace="moment += strengths[strongest] * distances[k]",
        tests=(TESTS + "test_intensities.py::test_a_mixed_beam_lies_between_what_it_meets_by_the_light_of_each",),
    ),
    Mutant(
        name="overflow that does not fade with the angle",
        file=FOLDER + "bright_kernels.py",
        find="own * math.exp(-apart / light.crosstalk_width)",
        replace="own * math.exp(-0.1 * apart / light.crosstalk_width)",
        tests=(
            TESTS + "test_intensities.py::test_beams_beside_a_strong_reflector_return_its_overflow_from_its_distance",
        ),
    ),
    Mutant(
        name="reflector behind the floor's edge still shines",
        file=FOLDER + "scan_kernels.py",
        find="distance, flags[i] = moment.range_limit, False",
        replace="distance, flags[i] = moment.range_limit, flags[i]",
        tests=(TESTS + "test_scan.py::test_tilted_floor_cuts_every_beam_and_hides_reflectors",),
    ),
    Mutant(
        name="noise of a range doubled",
        file=FOLDER + "scan_kernels.py",
        find="distance + beams.range_sigma * moment",
        replace="distance + 2.0 * beams.range_sigma * moment",
        tests=(TESTS + "test_scan.py::test_range_noise_has_the_scanners_sigma",),
    ),
    Mutant(
        name="plate shines from behind",
        file=FOLDER + "scan_kernels.py",
        find="-math.cos(facing) < FLAT_COSINE",
        replace="math.cos(facing) < FLAT_COSINE",
        tests=(TESTS + "test_scan.py::test_flat_plate_is_flagged_only_where_it_faces_the_scanner",),
    ),
    Mutant(
        name="plate turned the other way",
        file=FOLDER + "scan_kernels.py",
        find="math.cos(facing) / math.cos(facing - lit)",
        replace="math.cos(facing) / math.cos(facing + lit)",
        tests=(TESTS + "test_scan.py::test_flat_plate_is_flagged_only_where_it_faces_the_scanner",),
    ),
    Mutant(
        name="reflector behind a wall shines",
        file=FOLDER + "scan_kernels.py",
        find="if echo < echoes.distances[i] + hall.wall_depths[index]:",
        replace="if echo < echoes.distances[i] + 1000.0 * hall.wall_depths[index]:",
        tests=(TESTS + "test_scan.py::test_wall_hides_the_reflector_behind",),
    ),
    Mutant(
        name="noise of a bearing in degrees taken as radians",
        file=FOLDER + "scan.py",
        find="math.radians(scanner.bearing_sigma_deg),",
        replace="scanner.bearing_sigma_deg,",
        tests=(TESTS + "test_scan.py::test_beams_on_a_reflector_follow_equation_3_within_the_detectors_window",),
    ),
    Mutant(
        name="noise across the motion turned the wrong way",
        file=FOLDER + "drive.py",
        find="along * direction[:, 0] - across * direction[:, 1]",
        replace="along * direction[:, 0] + across * direction[:, 1]",
        tests=(TESTS + "test_drive.py::test_noise_of_a_motion_askew_lies_along_it_or_across_it",),
    ),
    Mutant(
        name="noise grows with the time and not its root",
        file=FOLDER + "drive.py",
        find="noise.forward_per_sqrt_s * math.sqrt(period)",
        replace="noise.forward_per_sqrt_s * period",
        tests=(TESTS + "test_drive.py::test_reported_motion_spreads_as_the_parameter_says",),
    ),
    Mutant(
        name="slips ten times as often",
        file=FOLDER + "drive.py",
        find="per_100_m * travelled[-1] / 100.0",
        replace="per_100_m * travelled[-1] / 10.0",
        tests=(TESTS + "test_drive.py::test_slips_report_motion_that_did_not_happen",),
    ),
    Mutant(
        name="reflectors covered a moment too long",
        file=FOLDER + "faults.py",
        find="(cover(record) if start_ns <= record.stamp_ns < end_ns",
        replace="(cover(record) if start_ns <= record.stamp_ns <= end_ns",
        tests=(TESTS + "test_faults.py::test_covered_period_includes_its_start_and_excludes_its_end",),
    ),
    Mutant(
        name="torn cable works once more",
        file=FOLDER + "faults.py",
        find="isinstance(record, Odometry) and start_ns <= record.stamp_ns",
        replace="isinstance(record, Odometry) and start_ns < record.stamp_ns",
        tests=(TESTS + "test_faults.py::test_stuck_odometry_reports_rest_for_its_period_only",),
    ),
    Mutant(
        name="worn wheel turns farther, too",
        file=FOLDER + "faults.py",
        find="(factor, factor, 1.0)",
        replace="(factor, factor, factor)",
        tests=(TESTS + "test_faults.py::test_scaled_odometry_stretches_the_way_and_not_the_turn",),
    ),
)
