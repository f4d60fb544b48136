"""The deliberate faults, one module per room: each is a kind that tests have missed before, or might."""

from tests.tools.mutants.app import APP
from tests.tools.mutants.cli import CLI
from tests.tools.mutants.geometry import GEOMETRY
from tests.tools.mutants.io import IO
from tests.tools.mutants.localization import LOCALIZATION
from tests.tools.mutants.mutant import Mutant
from tests.tools.mutants.page import PAGE
from tests.tools.mutants.planning import PLANNING
from tests.tools.mutants.simulation import SIMULATION
from tests.tools.mutants.site import SITE
from tests.tools.mutants.studies import STUDIES

MUTANTS: tuple[Mutant, ...] = (
    *(*GEOMETRY, *SITE, *LOCALIZATION, *PLANNING, *SIMULATION, *STUDIES),
    *(*IO, *APP, *PAGE, *CLI),
)

__all__ = ["MUTANTS", "Mutant"]
