"""What is predicted at a station: the worst moment there, the worse axis, and the larger of two figures; by hand."""

from __future__ import annotations

import numpy as np
import pytest

from commission.planning.error_budget import PredictedErrors
from commission.planning.nominal_drive import NominalDrive
from commission.planning.route_prediction import RoutePrediction
from commission.planning.station_accuracy import StationAccuracy, station_accuracies
from commission.site.parameters import SupervisorParameters
from commission.site.stations import Station


def accuracies(said: list[tuple[float, float]], true: list[tuple[float, float]]) -> tuple[StationAccuracy, ...]:
    """Of a station at 1.0 m, passed every 0.1 m; 1-sigma of x and y that the filter says, and of its error [m]."""
    count = len(said)
    poses = np.zeros((count, 3))
    poses[:, 0] = 0.75 + 0.1 * np.arange(count)
    covariances, squares = np.zeros((count, 3, 3)), np.zeros((count, 3, 3))
    for matrices, sigmas in ((covariances, said), (squares, true)):
        matrices[:, 0, 0], matrices[:, 1, 1] = np.square(sigmas).T
        matrices[:, 2, 2] = 9.0
    prediction = RoutePrediction(
        drive=NominalDrive(np.arange(count), poses, 4.0 + 0.1 * np.arange(count)),
        limits=SupervisorParameters(),
        prior_covariances=covariances,
        means=poses,
        covariances=covariances,
        modes=np.zeros(count, dtype=np.int8),
        seen=np.full(count, 2),
        on_odometry=np.zeros(count),
        innovations=np.zeros((0, 3)),
    )
    stations = (Station(name="Dock", x=1.0, y=0.0, required_accuracy=0.02), Station(name="Far", x=9.0, y=9.0))
    # Three quarters of the square of each error are noise, a quarter is the clock's.
    parts = np.array([0.75, 0.0, 0.0, 0.0, 0.25])[:, np.newaxis, np.newaxis] * squares[:, np.newaxis]
    errors = PredictedErrors(squares, np.zeros(len(squares)), parts)
    return station_accuracies(prediction, errors, stations)


def test_the_worst_moment_at_a_station_and_the_worse_axis_count() -> None:
    # The vehicle is there from 0.85 to 1.15 m: the second to the fifth scan.
    said = [(0.09, 0.0), (0.001, 0.002), (0.004, 0.001), (0.001, 0.005), (0.002, 0.002), (0.08, 0.0)]
    true = [(0.07, 0.0), (0.003, 0.001), (0.001, 0.001), (0.001, 0.001), (0.001, 0.001), (0.07, 0.0)]
    (dock,) = accuracies(said, true)
    assert (dock.station, dock.metre, dock.required) == ("Dock", pytest.approx(4.1), 0.02)
    assert (dock.two_sigma, dock.error) == pytest.approx((0.010, 0.006))
    assert dock.parts == pytest.approx((0.006 * np.sqrt(0.75), 0.0, 0.0, 0.0, 0.003))


@pytest.mark.parametrize(
    ("said", "true", "met"), [(0.0099, 0.0099, True), (0.0101, 0.001, False), (0.001, 0.0101, False)]
)
def test_a_station_is_met_when_both_figures_keep_to_it(said: float, true: float, met: bool) -> None:
    (dock,) = accuracies([(said, 0.0)] * 4, [(0.0, true)] * 4)
    assert dock.expected == pytest.approx(2.0 * max(said, true))
    assert dock.is_met is met
