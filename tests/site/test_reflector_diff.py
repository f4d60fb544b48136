from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from commission.errors import ProjectError
from commission.site.reflector_diff import ReflectorChange, ReflectorDiff, difference, merged, with_own_ids
from commission.site.reflectors import Reflector, ReflectorMap

A, B, C = Reflector(id="A", x=0.0, y=0.0), Reflector(id="B", x=5.0, y=0.0), Reflector(id="C", x=0.0, y=5.0)
METRES = st.integers(0, 10**4).map(lambda tenths: tenths / 1e4)
ONE = st.builds(Reflector, id=st.sampled_from("ABCDEFG"), x=METRES, y=METRES)
MAPS = st.lists(ONE, max_size=6, unique_by=lambda r: r.id).map(lambda rs: ReflectorMap(tuple(rs)))


def test_added_changed_and_removed_reflectors_are_told_apart() -> None:
    moved = replace(B, x=5.3, y=0.4)
    new = Reflector(id="D", x=9.0, y=9.0)
    diff = difference(ReflectorMap((A, B, C)), ReflectorMap((new, moved, A)))
    assert diff == ReflectorDiff((new,), (ReflectorChange(B, moved),), (C,), 1)
    assert diff.changed[0].fields == ("x", "y")
    assert diff.changed[0].moved == pytest.approx(0.5)


def test_what_a_file_rounds_away_is_no_change() -> None:
    exact = replace(A, x=5.640000000000006, heading=1.0 / 3.0)
    rounded = replace(A, x=5.64, heading=0.333333)
    assert not difference(ReflectorMap((exact,)), ReflectorMap((rounded,)))
    assert difference(ReflectorMap((exact,)), ReflectorMap((replace(rounded, x=5.6401),))).changed


def test_reflector_that_only_changed_its_name_is_recognized_by_its_place() -> None:
    renamed = Reflector(id="17", x=5.01, y=0.0)
    diff = difference(ReflectorMap((A, B)), ReflectorMap((A, renamed)))
    assert diff == ReflectorDiff((), (ReflectorChange(B, renamed),), (), 1)
    assert "id" in diff.changed[0].fields
    by_id = difference(ReflectorMap((A, B)), ReflectorMap((A, renamed)), same_place=0.0)
    assert by_id == ReflectorDiff((renamed,), (), (B,), 1)


@given(before=MAPS, after=MAPS)
def test_every_reflector_is_counted_once_and_applying_the_difference_gives_the_later_map(
    before: ReflectorMap, after: ReflectorMap
) -> None:
    diff = difference(before, after)
    assert diff.unchanged + len(diff.changed) + len(diff.added) == len(after)
    assert diff.unchanged + len(diff.changed) + len(diff.removed) == len(before)
    assert bool(diff) == (set(before.reflectors) != set(after.reflectors))
    result = merged(before, diff, remove=True)
    assert set(result.reflectors) == set(after.reflectors)


def test_fields_that_an_import_is_silent_about_stay_as_they_are() -> None:
    before = replace(A, height=1.8, note="pillar", locked=True)
    diff = difference(ReflectorMap((before, B)), ReflectorMap((replace(A, x=0.5), B)), fields=("id", "x", "y"))
    assert diff.changed == (ReflectorChange(before, replace(before, x=0.5)),)
    assert diff.changed[0].fields == ("x",)


def test_reflectors_that_an_import_lacks_can_stay() -> None:
    diff = difference(ReflectorMap((A, B)), ReflectorMap((C,)))
    assert merged(ReflectorMap((A, B)), diff, remove=False).reflectors == (A, B, C)


def test_name_that_would_be_used_twice_is_refused() -> None:
    before = ReflectorMap((A, B))
    # The import calls B's place A; the A that it lacks stays, unless it is removed.
    diff = ReflectorDiff(changed=(ReflectorChange(B, replace(B, id="A")),), removed=(A,))
    with pytest.raises(ProjectError, match="'A' is used twice"):
        merged(before, diff, remove=False)
    assert merged(before, diff, remove=True).reflectors == (replace(B, id="A"),)


def test_made_up_ids_give_way_to_those_of_the_reflectors_at_their_places() -> None:
    # A spreadsheet without names calls its rows R1, R2: they are not the reflectors of those names.
    before = ReflectorMap((Reflector(id="R1", x=0.0, y=0.0), Reflector(id="R2", x=5.0, y=0.0)))
    unnamed = ReflectorMap((Reflector(id="R1", x=5.01, y=0.0), Reflector(id="R2", x=9.0, y=9.0)))
    assert with_own_ids(before, unnamed).reflectors == (
        Reflector(id="R2", x=5.01, y=0.0),
        Reflector(id="R3", x=9.0, y=9.0),
    )
    assert with_own_ids(ReflectorMap(), unnamed) == unnamed
    diff = difference(before, unnamed, fields=("x", "y"))
    assert [change.after.id for change in diff.changed] == ["R2"]
    assert [reflector.id for reflector in diff.added] == ["R3"]
    assert merged(before, diff, remove=False).reflectors[0] == before.reflectors[0]
