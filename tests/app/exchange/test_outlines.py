from __future__ import annotations

import numpy as np

from commission.app.exchange.outlines import outlines_of
from commission.app.exchange.pending import Pasted, Pending
from commission.app.exchange.preview import compare
from commission.io.imk import ReflectorImport
from commission.io.imports import WHOLE, Imported
from commission.io.route_edges import RouteImport
from commission.site.reflectors import Reflector, ReflectorMap
from commission.site.routes import Route, Segment
from commission.site.stations import Station
from tests.app.sites import room


def pending(imported: Imported) -> Pending:
    return Pending(source=Pasted(""), choice=WHOLE, imported=imported, found=compare(room(), imported))


def test_added_and_moved_reflectors_are_drawn_where_they_would_stand() -> None:
    table = ReflectorMap(
        (
            Reflector(id="R1", x=0.25, y=2.5),
            Reflector(id="R2", x=0.25, y=6.5, radius=0.05),
            Reflector(id="N", x=6.0, y=7.8),
        )
    )
    outlines = outlines_of(room(), pending(ReflectorImport(table)))
    assert outlines.centers.tolist() == [[6.0, 7.8], [0.25, 2.5]]
    assert [line.tolist() for line in outlines.lines] == [[[0.25, 2.0], [0.25, 2.5]]]


def test_new_courses_of_routes_and_new_stations_are_drawn() -> None:
    route = Route("Detour", (Segment(control_points=np.array([[2.0, 2.0], [4.0, 6.0]]), degree=1),))
    layout = RouteImport(
        routes=(route,),
        warnings=(),
        stations=(Station(name="Dock", x=4.0, y=6.0),),
        vehicle_types=("V",),
        layouts=("hall",),
    )
    outlines = outlines_of(room(), pending(layout))
    assert outlines.centers.tolist() == [[4.0, 6.0]]
    np.testing.assert_allclose(outlines.lines[0][[0, -1]], [[2.0, 2.0], [4.0, 6.0]], atol=1e-9)


def test_nothing_is_drawn_of_no_import() -> None:
    outlines = outlines_of(room(), None)
    assert (len(outlines.centers), outlines.lines) == (0, ())
