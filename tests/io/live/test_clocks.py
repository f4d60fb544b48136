from __future__ import annotations

import itertools
import random

from commission.io.live.clocks import DevicePlace, HostClock

MS = 1_000_000
S = 1_000_000_000


def test_stamps_of_a_device_are_even_though_the_network_is_not() -> None:
    place, rng = DevicePlace(), random.Random(1)
    stamps = []
    for number in range(400):
        device = 5 * S + number * 40 * MS
        stamps.append(place.stamp(device, device + 700 * S + rng.choice([0, 0, 1 * MS, 9 * MS])))
    steps = {late - early for early, late in itertools.pairwise(stamps[20:])}
    assert steps == {40 * MS}
    assert stamps[-1] == 5 * S + 399 * 40 * MS + 700 * S


def test_stamps_never_go_back_while_the_least_delay_is_being_found() -> None:
    place = DevicePlace()
    late = [50, 30, 5, 1, 0]
    stamps = [place.stamp(number * 10 * MS, 100 * S + number * 10 * MS + late[number] * MS) for number in range(5)]
    assert stamps == sorted(set(stamps))


def test_records_of_one_moment_of_a_device_have_one_stamp() -> None:
    place = DevicePlace()
    assert place.stamp(7 * S, 50 * S) == place.stamp(7 * S, 50 * S + 3 * MS)


def test_a_device_that_begins_again_is_placed_anew() -> None:
    place = DevicePlace()
    first = place.stamp(100 * S, 500 * S)
    assert place.stamp(2 * S, 501 * S) == 501 * S > first
    assert place.begun_again == 1


def test_what_a_network_that_stalls_delays_is_stamped_as_it_was_measured() -> None:
    place = DevicePlace()
    for number in range(50):
        place.stamp(number * 40 * MS, 9 * S + number * 40 * MS)
    # For 3 s nothing comes, then everything at once.
    late = [place.stamp(number * 40 * MS, 9 * S + 125 * 40 * MS + number * MS // 10) for number in range(50, 125)]
    assert late == [9 * S + number * 40 * MS for number in range(50, 125)]
    assert place.begun_again == 0


def test_a_clock_that_stood_still_is_placed_anew_without_a_new_sender() -> None:
    place = DevicePlace()
    for number in range(200):
        paused = 0 if number < 100 else 5 * S
        stamp = place.stamp(number * 40 * MS, 9 * S + number * 40 * MS + paused)
    assert stamp == 9 * S + 199 * 40 * MS + 5 * S
    assert place.begun_again == 0


def test_a_device_whose_clock_drifts_is_followed() -> None:
    place = DevicePlace()
    for number in range(5_000):
        # It is slow by 50 us in a second.
        device = number * 40 * MS
        arrived = round(device * 1.00005) + 9 * S
        stamp = place.stamp(device, arrived)
        assert abs(stamp - arrived) <= 1.1 * MS


def test_a_step_of_the_computers_clock_is_not_in_the_hosts_time() -> None:
    wall, monotonic = [1_000 * S], [5 * S]
    clock = HostClock(lambda: monotonic[0], lambda: wall[0])
    before = clock.now_ns()
    wall[0] += 3600 * S
    monotonic[0] += S
    assert clock.now_ns() - before == S
