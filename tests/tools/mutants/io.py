"""Faults of files: units, axes and columns swapped, what is upside down or inverted."""

from tests.tools.mutants.mutant import Mutant

FOLDER, TESTS = "commission/io/", "tests/io/"

IO = (
    Mutant(
        name="map upside down",
        file=FOLDER + "map_server.py",
        find="FloorMap(np.flipud(cells), description",
        replace="FloorMap(cells, description",
        tests=(TESTS + "test_map_server.py::test_first_row_of_the_image_is_the_far_side_of_the_floor",),
    ),
    Mutant(
        name="negated map read as a usual one",
        file=FOLDER + "map_server.py",
        find="brightness if description.negate else 1.0 - brightness",
        replace="1.0 - brightness",
        tests=(TESTS + "test_map_server.py::test_negated_map_takes_white_for_walls",),
    ),
    Mutant(
        name="occupied at the threshold itself",
        file=FOLDER + "map_server.py",
        find="occupancy > description.occupied_thresh",
        replace="occupancy >= description.occupied_thresh",
        tests=(TESTS + "test_map_server.py::test_cell_exactly_at_a_threshold_is_unknown",),
    ),
    Mutant(
        name="percent of a raw map taken for gray values",
        file=FOLDER + "map_server.py",
        find="occupancy = percent / 100.0",
        replace="occupancy = percent / 255.0",
        tests=(TESTS + "test_map_server.py::test_raw_map_holds_percent_and_everything_beyond_is_unknown",),
    ),
    Mutant(
        name="diameter of an IMK layout taken for the radius",
        file=FOLDER + "imk.py",
        find="radius=size / 2000.0",
        replace="radius=size / 1000.0",
        tests=(TESTS + "test_imk.py::test_layout_of_a_real_sensor_is_read",),
    ),
    Mutant(
        name="LIF layout driven the other way round",
        file=FOLDER + "lif_writer.py",
        find="math.pi if segment.direction is Direction.REVERSE else 0.0",
        replace="0.0 if segment.direction is Direction.REVERSE else math.pi",
        tests=(TESTS + "test_lif.py::test_routes_that_are_written_and_read_again_are_equal",),
    ),
    Mutant(
        name="variance of y in the column of x and heading",
        file=FOLDER + "results.py",
        find="(0, 2), (1, 1)",
        replace="(1, 1), (0, 2)",
        tests=(TESTS + "test_results.py::test_every_cycle_is_a_row_that_reads_back_to_the_last_bit",),
    ),
    Mutant(
        name="inliers in the column of outliers",
        file=FOLDER + "results.py",
        find="run.counts(Status.INLIER),\n        outliers",
        replace="outliers,\n        run.counts(Status.INLIER)",
        tests=(TESTS + "test_results.py::test_every_cycle_is_a_row_that_reads_back_to_the_last_bit",),
    ),
    Mutant(
        name="heading of a coverage in radians called degrees",
        file=FOLDER + "coverage_files.py",
        find='"heading_sigma": "_rad"',
        replace='"heading_sigma": "_deg"',
        tests=(TESTS + "test_coverage_files.py::test_files_hold_the_figures_of_the_floor",),
    ),
    Mutant(
        name="scans of a safety scanner stamped as they arrive",
        file=FOLDER + "live/safety_driver.py",
        find="None if found.time_ns is None else self._even.of(found.scan_number, found.time_ns)",
        replace="None",
        tests=(
            TESTS + "live/test_device_clocks.py"
            "::test_a_drive_whose_scans_and_odometry_come_late_is_localized_like_one_in_time",
        ),
    ),
    Mutant(
        name="drift of a device's clock added the wrong way round",
        file=FOLDER + "live/clocks.py",
        find="round(drift * (device_ns - at_ns))",
        replace="round(drift * (at_ns - device_ns))",
        tests=(TESTS + "live/test_clocks.py::test_a_device_whose_clock_drifts_is_followed",),
    ),
    Mutant(
        name="clock that stands still taken for a clock",
        file=FOLDER + "live/clocks.py",
        find="self.is_still = device_ns == self._last_ns and",
        replace="self.is_still = device_ns > self._last_ns and",
        tests=(TESTS + "live/test_device_clocks.py::test_a_clock_that_stands_still_is_none",),
    ),
    Mutant(
        name="two clients of a scanner read as one stream",
        file=FOLDER + "recordings/capture.py",
        find='receiver = payload.receiver if payload.is_stream else ""',
        replace='receiver = ""',
        tests=(TESTS + "recordings/test_odd_captures.py::test_scanner_that_serves_two_clients_at_once_is_read_once",),
    ),
    Mutant(
        name="any transform taken for odometry",
        file=FOLDER + "recordings/ros_messages.py",
        find='return str(stamped.header.frame_id).rpartition("/")[2] == ODOM_FRAME',
        replace="return True",
        tests=(
            TESTS
            + "recordings/test_odd_bags.py::"
            + "test_vehicle_whose_odometry_is_in_transforms_only_is_moved_by_them",
        ),
    ),
    Mutant(
        name="what stands behind the last record is not carried",
        file=FOLDER + "recordings/recorder.py",
        find="        while first is not None:\n            self.append_beside(first)",
        replace="        while False and first is not None:\n            self.append_beside(first)",
        tests=(TESTS + "recordings/test_carried.py::test_bytes_are_the_same_after_a_way_through_every_format",),
    ),
)
