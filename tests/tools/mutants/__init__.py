"""The deliberate faults, one module per room: each is a kind that tests have missed before, or might."""

from tests.tools.mutants.localization import LOCALIZATION
from tests.tools.mutants.mutant import Mutant

MUTANTS: tuple[Mutant, ...] = (*LOCALIZATION,)

__all__ = ["MUTANTS", "Mutant"]
