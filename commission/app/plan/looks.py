"""From what was computed for the step Plan to what panels and layers draw. Pure; when it is drawn is `planner`'s."""

from __future__ import annotations

import numpy as np

from commission.app.ambiguity.cold_start import Ambiguity
from commission.app.coverage.scale import FIRST, NO_FIX, QUANTITIES, Scale
from commission.app.placement.suggestion import LayoutWish, Suggestion
from commission.app.plan.settings import PlanSettings
from commission.app.plan.view import (
    ColdStartView,
    FailureView,
    HeatView,
    LayoutView,
    Reading,
    RiskView,
    RouteView,
    TwinsView,
    stretches,
)
from commission.app.plan.work import Covered, Predicted, Ranked
from commission.geometry.arrays import FloatArray
from commission.planning.association_risk import NeighborRisk
from commission.site.project import Project


def heat_view(covered: Covered, scale: Scale, *, outdated: bool) -> HeatView:
    """Sort the figure into the classes of its scale."""
    lattice = covered.live.coverage.lattice
    classes = scale.classes(getattr(covered.live.coverage.fixes, scale.figure.value), covered.floor)
    counts = np.bincount(classes, minlength=FIRST + len(scale.bounds) + 1)[NO_FIX:]
    return HeatView(
        lattice, scale, classes.reshape(lattice.rows, lattice.columns), counts / max(1, counts.sum()), outdated
    )


def reading_of(covered: Covered, probe: tuple[float, float]) -> Reading | None:
    """Read every figure at a place; none beside the lattice."""
    index = covered.live.coverage.lattice.index_near(*probe)
    if index is None:
        return None
    fixes = covered.live.coverage.fixes
    values = {figure: float(getattr(fixes, figure.value)[index]) for figure in QUANTITIES}
    return Reading(probe, values, bool(covered.floor[index]))


def route_view(predicted: Predicted, *, outdated: bool) -> RouteView:
    """Gather the worst of each metre."""
    prediction = predicted.prediction
    metres = prediction.per_metre()
    chances = np.zeros(len(prediction.drive))
    for risk in predicted.risks:
        chances[risk.scans] = np.maximum(chances[risk.scans], risk.probability)
    return RouteView(
        predicted.name,
        prediction,
        metres,
        predicted.errors.per_metre(metres),
        np.maximum.reduceat(prediction.load, metres.first),
        np.maximum.reduceat(chances, metres.first),
        tuple(_risk_view(predicted, risk) for risk in predicted.risks),
        predicted.stations,
        outdated,
    )


def _risk_view(predicted: Predicted, risk: NeighborRisk) -> RiskView:
    """Name two neighbors, and the places from which one may be taken for the other."""
    reflectors, poses = predicted.reflectors.reflectors, predicted.prediction.drive.poses
    worst = poses[risk.scans[int(np.argmax(risk.probability))]]
    return RiskView(
        reflectors[risk.reflector].id,
        reflectors[risk.neighbor].id,
        risk.worst,
        tuple(np.unique(risk.metres.astype(np.int64)).tolist()),
        poses[risk.scans, :2],
        (float(worst[0]), float(worst[1])),
    )


def failure_view(ranked: Ranked, failed: str, *, outdated: bool) -> FailureView:
    """Find the reflector that is shown, and the stretches of the routes that depend on it."""
    reflectors = ranked.reflectors
    names = tuple(reflectors.reflectors[each.reflector].id for each in ranked.ranking)
    chosen = ranked.ranking[names.index(failed)] if failed in names else None
    places = {reflector.id: (reflector.x, reflector.y) for reflector in reflectors.reflectors}
    failing = list[FloatArray]()
    if chosen is not None:
        for planned, part in zip(ranked.planned, chosen.routes, strict=True):
            fails = np.isin(planned.drive.metres.astype(np.int64), part.metres)
            failing.extend(stretches(planned.drive.poses[:, :2], fails))
    return FailureView(
        ranked.ranking,
        names,
        tuple(reflectors.reflectors[index].id for index in ranked.fallen),
        reflectors.centers[list(ranked.fallen)],
        failed,
        chosen,
        places.get(failed),
        tuple(failing),
        outdated,
    )


def cold_start_view(ambiguity: Ambiguity, plan: PlanSettings, *, outdated: bool) -> ColdStartView:
    """Find the reflectors and poses of the pair that is shown."""
    twins = None
    if 0 <= plan.pair < len(ambiguity.pairs):
        pair = ambiguity.pairs[plan.pair]
        centers = ambiguity.reflectors.centers
        groups = centers[list(pair.constellation)], centers[list(pair.image)]
        twins = TwinsView(groups, (pair.example, pair.partner))
    return ColdStartView(ambiguity, twins, not plan.figure, outdated)


def layout_view(suggestion: Suggestion, project: Project, wish: LayoutWish) -> LayoutView:
    """Hold a suggestion against the site and the wishes of now."""
    return LayoutView(
        suggestion,
        outdated=not suggestion.is_of(project),
        wished_otherwise=suggestion.wish != wish or suggestion.site.layout != project.layout,
    )
