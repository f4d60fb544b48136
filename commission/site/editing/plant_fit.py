"""The map's frame onto the plant's by many surveyed points: least squares, and what each point is off by.

A map keeps its scale, as with two points (`alignment`): what the distances say otherwise is told.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from commission.errors import UsageError
from commission.geometry import se2
from commission.geometry.arrays import FloatArray
from commission.site.editing.alignment import NEAREST, WRONG
from commission.site.project import Project

STRIKING = 3.0
"""A point that is off by so many times the RMS of the others stands out."""
SMALLEST_M = 0.002
"""What nobody surveys better than, so that nothing below it stands out [m]."""


@dataclass(frozen=True, slots=True)
class PlantPair:
    """A point of the map that was surveyed in the plant."""

    name: str
    """What it is called."""
    at: tuple[float, float]
    """Where it lies in the map [m, m]."""
    plant: tuple[float, float]
    """Where it lies in the plant's coordinate system [m, m]."""


@dataclass(frozen=True, slots=True, eq=False)
class PlantFit:
    """How points move and turn a map."""

    pairs: tuple[PlantPair, ...]
    """What it was made of."""
    T_plant_map: FloatArray
    """(3,) pose of the map's frame in the plant's [m, m, rad]."""
    residuals: FloatArray
    """(N, 2) where the plant has each point less where the moved map has it [m], plant axes."""
    scale: float
    """By what factor distances in the plant are those on the map; it is not applied."""

    @property
    def offs(self) -> FloatArray:
        """(N,) by how much each point is missed [m]."""
        return np.hypot(self.residuals[:, 0], self.residuals[:, 1])

    @property
    def rms(self) -> float:
        """Root mean square of these [m]."""
        return float(np.sqrt(np.mean(self.offs**2)))

    @property
    def striking(self) -> tuple[str, ...]:
        """Names of points that stand out: by themselves they spoil a fit that is good for all others."""
        if len(self.pairs) < 4:
            return ()
        found: list[str] = []
        for index, pair in enumerate(self.pairs):
            try:
                others = fit_points([each for number, each in enumerate(self.pairs) if number != index], check=False)
            except UsageError:
                # Without it all lie at one place: nothing can be held against it.
                continue
            off = np.subtract(pair.plant, se2.transform_points(others.T_plant_map, np.array(pair.at)))
            if float(np.hypot(*off)) > STRIKING * max(others.rms, SMALLEST_M):
                found.append(pair.name)
        return tuple(found) if len(found) < len(self.pairs) else ()


def fit_points(pairs: Sequence[PlantPair], *, check: bool = True) -> PlantFit:
    """Move and turn a map so that the sum of the squared distances of its points to the plant's is least.

    Parameters
    ----------
    pairs : two at least, not all at one place.
    check : whether pairs that no move explains (mirrored, of another scale) are refused.

    Raises
    ------
    UsageError
        there are too few points, they lie too close together, or no move explains them.

    Notes
    -----
    Turn arg(sum conj(p) q) of centered points p, q as complex numbers: Umeyama 1991, equation 40, in the plane.
    """
    if len(pairs) < 2:
        raise UsageError(f"{len(pairs)} points are known on the map and in the plant; expected 2 or more, better 4")
    here = np.array([each.at for each in pairs], dtype=np.float64)
    there = np.array([each.plant for each in pairs], dtype=np.float64)
    middle_here, middle_there = here.mean(axis=0), there.mean(axis=0)
    p, q = (
        (points - middle) @ np.array([1.0, 1.0j]) for points, middle in ((here, middle_here), (there, middle_there))
    )
    reach = float(np.abs(p).max(initial=0.0))
    if not min(reach, float(np.abs(q).max(initial=0.0))) >= 0.5 * NEAREST:
        raise UsageError(
            f"all points lie within {2.0 * reach:.3f} m; expected them {NEAREST:g} m apart, better far more"
        )
    as_it_is, mirrored = np.sum(np.conj(p) * q), np.sum(p * q)
    scale = float(abs(as_it_is) / np.sum(np.abs(p) ** 2))
    turn = float(np.angle(as_it_is))
    x, y = middle_there - se2.transform_points(np.array([0.0, 0.0, turn]), middle_here)
    T = np.array([x, y, turn])
    fit = PlantFit(tuple(pairs), T, there - se2.transform_points(T, here), scale)
    if check:
        _check(fit, mirrored=len(pairs) > 2 and abs(mirrored) > 1.05 * abs(as_it_is))
    return fit


def _check(fit: PlantFit, *, mirrored: bool) -> None:
    """Refuse points that no move explains; raises UsageError."""
    if mirrored:
        raise UsageError(
            "the points in the plant are a mirror image of those on the map; expected x to the right of y in both: "
            "x and y are probably exchanged in the table"
        )
    if abs(fit.scale - 1.0) > WRONG:
        worst = fit.pairs[int(np.argmax(fit.offs))].name
        raise UsageError(
            f"distances in the plant are {fit.scale:.4f} times those on the map; expected 1 within "
            f"{100.0 * WRONG:g} %: a wrong unit, or a wrong point such as {worst!r}"
        )


def pairs_of(
    project: Project,
    surveyed: Iterable[tuple[str, float, float]],
    free: Iterable[tuple[str, float, float]] = (),
) -> tuple[tuple[PlantPair, ...], tuple[str, ...]]:
    """Pair surveyed points with reflectors, stations and free points of the same name.

    Parameters
    ----------
    project : the site, in the map's frame.
    surveyed : name, x and y of each point in the plant's coordinates [m].
    free : name, x and y [m], map frame, of points that are neither: corners, columns, marks on the floor. Where one is
        called as a reflector or a station is, it is the one that is meant.

    Returns
    -------
    pairs, unknown : the pairs, and names that nothing of the project has.

    Raises
    ------
    UsageError
        a name comes twice.
    """
    places = {station.name.casefold(): (station.x, station.y) for station in project.stations}
    places |= {each.id.casefold(): (each.x, each.y) for each in project.reflectors.reflectors}
    places |= {name.casefold(): (x, y) for name, x, y in free}
    pairs: list[PlantPair] = []
    unknown: list[str] = []
    seen = set[str]()
    for name, x, y in surveyed:
        key = name.casefold()
        if key in seen:
            raise UsageError(f"{name!r} is surveyed twice; expected each point once")
        seen.add(key)
        if key in places:
            pairs.append(PlantPair(name, places[key], (x, y)))
        else:
            unknown.append(name)
    return tuple(pairs), tuple(unknown)
