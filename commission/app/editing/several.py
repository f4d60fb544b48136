"""What is selected several at once in the tables of the site, how it is selected and set. Pure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from commission.app.base.actions import Action
from commission.app.base.state import AppState
from commission.app.editing.actions import SetRoute, SetScannerField
from commission.app.editing.editor import ControlPoint, PosedKey, PosedKind, editor_of
from commission.app.editing.posed_actions import SetPosed
from commission.app.editing.posed_kinds import KINDS, marks_of
from commission.app.editing.route_gestures import routes_of
from commission.app.editing.zone_actions import CountKind, SetZone
from commission.app.editing.zone_reducer import ShownZone, zones_of
from commission.site.zones import ObservationKind

COUNTS = "kinds:"
"""What precedes the kind of an observation in the key of a column that says whether it counts in a zone."""


@dataclass(frozen=True, slots=True)
class ChosenScanners:
    """Which scanners a browser has selected in their table."""

    names: tuple[str, ...] = ()
    """Their names; those that are gone are ignored."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Several:
    """How the things of one table are selected and set several at once."""

    kind: str
    """What one of them is called."""
    chosen: Callable[[AppState, int | None], tuple[str, ...]]
    """From a browser to the keys of what it has selected."""
    choose: Callable[[AppState, int | None, tuple[str, ...]], AppState]
    """From a browser and keys to the state in which these are selected; the last one is shown."""
    setting: Callable[[str, object, str], Action]
    """From field, value and key to the action that sets it of one."""
    alone: frozenset[str]
    """Fields that several cannot share."""


def counting(field: str, value: object, key: str) -> Action:
    """Return the action of an entry in the table of zones.

    Parameters
    ----------
    field : of `Zone`, or whether a kind of observation counts.
    value : new one, SI.
    key : name of the zone.
    """
    if field.startswith(COUNTS):
        return CountKind(ObservationKind(field.removeprefix(COUNTS)), bool(value), key)
    return SetZone(field, value, key)


def _of_posed(kind: PosedKind) -> Several:
    key_of = KINDS[kind].named.key_of

    def chosen(state: AppState, browser: int | None) -> tuple[str, ...]:
        editor = editor_of(state, browser)
        is_of_kind = editor.posed is not None and editor.posed.kind is kind
        return tuple(map(key_of, marks_of(state.project, editor))) if is_of_kind else ()

    def choose(state: AppState, browser: int | None, keys: tuple[str, ...]) -> AppState:
        last = PosedKey(kind, keys[-1]) if keys else None
        return state.with_browser(browser, editor_of(state, browser).selecting(posed=last, further=keys[:-1]))

    return Several(
        kind=kind,
        chosen=chosen,
        choose=choose,
        setting=lambda field, value, key: SetPosed(kind, field, value, key),
        alone=frozenset({KINDS[kind].named.key, "x", "y"}),
    )


def _choose_routes(state: AppState, browser: int | None, keys: tuple[str, ...]) -> AppState:
    last = ControlPoint(keys[-1]) if keys else None
    return state.with_browser(browser, editor_of(state, browser).selecting(point=last, further=keys[:-1]))


def _choose_zones(state: AppState, browser: int | None, keys: tuple[str, ...]) -> AppState:
    return state.with_browser(browser, ShownZone(keys[-1], keys[:-1]) if keys else ShownZone())


def _chosen_scanners(state: AppState, browser: int | None) -> tuple[str, ...]:
    there = {each.name for each in state.project.scanners}
    return tuple(name for name in state.of_browser(browser, ChosenScanners).names if name in there)


SEVERAL: Mapping[str, Several] = {
    "routes": Several(
        kind="route",
        chosen=lambda state, browser: routes_of(state.project, editor_of(state, browser)),
        choose=_choose_routes,
        setting=SetRoute,
        alone=frozenset({"name"}),
    ),
    "stations": _of_posed(PosedKind.STATION),
    "tags": _of_posed(PosedKind.TAG),
    "zones": Several(
        kind="zone", chosen=zones_of, choose=_choose_zones, setting=counting, alone=frozenset({"name", "outline"})
    ),
    "scanners": Several(
        kind="scanner",
        chosen=_chosen_scanners,
        choose=lambda state, browser, keys: state.with_browser(browser, ChosenScanners(keys)),
        setting=SetScannerField,
        alone=frozenset({"name"}),
    ),
}
"""By the name of the table."""
