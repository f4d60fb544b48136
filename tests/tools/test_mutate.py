"""Every deliberate fault can still be made. Whether the tests see them is for `mutate` itself to say."""

from __future__ import annotations

import pytest

from tests.tools.mutants import MUTANTS, Mutant
from tests.tools.mutate import checked


def test_every_mutant_can_be_made_and_names_tests_that_exist() -> None:
    checked(MUTANTS)


def test_a_fault_that_fits_nowhere_or_twice_is_refused() -> None:
    mutant = Mutant(name="n", file="f.py", find="a + b", replace="a - b", tests=())
    assert mutant.applied_to("x = a + b\n") == "x = a - b\n"
    for text, times in (("x = a\n", 0), ("x = a + b + a + b\n", 2)):
        with pytest.raises(ValueError, match=rf"'a \+ b' occurs {times} times; expected once, for 'n'"):
            mutant.applied_to(text)
