"""What a change of the reflector map adds, changes and removes: the preview of an import. No files here."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from commission.site.editing.names import fresh_names
from commission.site.fields import in_file
from commission.site.reflectors import Reflector, ReflectorMap

SAME_PLACE = 0.05
"""Distance [m] within which two reflectors of different id are taken for one: surveys agree to a few centimetres, and
no two reflectors stand that close."""


@dataclass(frozen=True, slots=True)
class ReflectorChange:
    """One reflector that is there before and after, and differs."""

    before: Reflector
    """As it is now."""
    after: Reflector
    """As it would be."""

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the fields that differ."""
        names = [field.name for field in dataclasses.fields(Reflector)]
        return tuple(name for name in names if getattr(self.before, name) != getattr(self.after, name))

    @property
    def moved(self) -> float:
        """Distance between the two places [m]."""
        return math.hypot(self.after.x - self.before.x, self.after.y - self.before.y)


@dataclass(frozen=True, slots=True)
class ReflectorDiff:
    """Difference between two reflector maps."""

    added: tuple[Reflector, ...] = ()
    """Reflectors that are only in the later map."""
    changed: tuple[ReflectorChange, ...] = ()
    """Reflectors that are in both and differ, by their id or by their place."""
    removed: tuple[Reflector, ...] = ()
    """Reflectors that are only in the earlier map."""
    unchanged: int = 0
    """Number of reflectors that are the same in both."""

    def __bool__(self) -> bool:
        """Whether there is any difference."""
        return bool(self.added or self.changed or self.removed)


def difference(
    before: ReflectorMap,
    after: ReflectorMap,
    *,
    same_place: float = SAME_PLACE,
    fields: Collection[str] | None = None,
) -> ReflectorDiff:
    """Compare two reflector maps.

    Parameters
    ----------
    before, after : the maps.
    same_place : reflectors that share no id with the other map are still one reflector, renamed, when each is the
        other's nearest and they are at most so far apart [m]; 0 compares by id alone.
    fields : fields that `after` speaks of, for a format that knows no others: what it is silent about stays as it
        is. Without `id` its ids are made up: reflectors are then compared by their places. All when None.

    Returns
    -------
    difference : added and changed in the order of `after`, removed in the order of `before`.
    """
    if fields is not None and "id" not in fields:
        after = with_own_ids(before, after, same_place=same_place)
    partners = _partners(before, after, same_place)
    silent = [f.name for f in dataclasses.fields(Reflector) if fields is not None and f.name not in (*fields, "id")]
    pairs = [_pair(partners.get(reflector.id), reflector, silent) for reflector in after.reflectors]
    kept = {old.id for old in partners.values()}
    # Compared as files have them: what was exported and comes back is no change.
    changed = tuple(ReflectorChange(old, new) for old, new in pairs if old is not None and in_file(old) != in_file(new))
    return ReflectorDiff(
        added=tuple(new for old, new in pairs if old is None),
        changed=changed,
        removed=tuple(old for old in before.reflectors if old.id not in kept),
        unchanged=len(partners) - len(changed),
    )


def merged(before: ReflectorMap, diff: ReflectorDiff, *, remove: bool) -> ReflectorMap:
    """Apply a difference to the map from which it starts, keeping that map's order; what is added comes last.

    Parameters
    ----------
    before : the earlier map of `diff`.
    diff : what to add, change and remove.
    remove : whether reflectors that are absent from the later map go, or stay.

    Raises
    ------
    ProjectError
        two reflectors would have one id: one that stays, and one that was renamed or added.
    """
    gone = {reflector.id for reflector in diff.removed} if remove else set[str]()
    changes = {change.before.id: change.after for change in diff.changed}
    kept = [changes.get(reflector.id, reflector) for reflector in before.reflectors if reflector.id not in gone]
    return ReflectorMap((*kept, *diff.added))


def with_own_ids(before: ReflectorMap, after: ReflectorMap, *, same_place: float = SAME_PLACE) -> ReflectorMap:
    """Return `after` with other ids: for a source without names, whose ids were made up.

    Parameters
    ----------
    before, after : the maps.
    same_place : a reflector of `after` takes the id of the one of `before` within this distance [m]; each is the
        other's nearest. Others go on with the numbering of `before`.
    """
    partners = _by_place(before.reflectors, after.reflectors, same_place)
    taken = [reflector.id for reflector in before.reflectors]
    free = iter(fresh_names(taken, len(after) - len(partners), taken[-1] if taken else "R0"))
    return ReflectorMap(
        tuple(
            dataclasses.replace(r, id=partners[i].id if i in partners else next(free))
            for i, r in enumerate(after.reflectors)
        )
    )


def _pair(old: Reflector | None, new: Reflector, silent: list[str]) -> tuple[Reflector | None, Reflector]:
    """Reflector before and after, the latter with the earlier values of the fields that nothing is said about."""
    if old is None or not silent:
        return old, new
    return old, dataclasses.replace(new, **{name: getattr(old, name) for name in silent})


def _partners(before: ReflectorMap, after: ReflectorMap, same_place: float) -> dict[str, Reflector]:
    """Earlier reflector of each later one that has one, by the later one's id."""
    by_id = {reflector.id: reflector for reflector in before.reflectors}
    partners = {r.id: by_id[r.id] for r in after.reflectors if r.id in by_id}
    old = [r for r in before.reflectors if r.id not in partners]
    new = [r for r in after.reflectors if r.id not in partners]
    return partners | {new[i].id: partner for i, partner in _by_place(old, new, same_place).items()}


def _by_place(old: Sequence[Reflector], new: Sequence[Reflector], same_place: float) -> dict[int, Reflector]:
    """Earlier reflector of each later one whose nearest it is, and the other way round, by the later one's index."""
    if not (same_place > 0.0 and old and new):
        return {}
    from scipy.spatial import KDTree

    old_centers, new_centers = (np.array([(r.x, r.y) for r in several]) for several in (old, new))
    distance, nearest_old = map(np.asarray, KDTree(old_centers).query(new_centers))
    nearest_new = np.asarray(KDTree(new_centers).query(old_centers)[1])
    is_mutual = nearest_new[nearest_old] == np.arange(len(new))
    return {int(i): old[int(nearest_old[i])] for i in np.flatnonzero(is_mutual & (distance <= same_place))}
