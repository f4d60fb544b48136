"""What the actions about variants mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from dataclasses import dataclass, replace

from commission.app.base.actions import Sender
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.run.variant_actions import DropRun, DropVariant, KeepRun, KeepVariant, UseVariant
from commission.errors import UsageError
from commission.site.project import Project

LETTERS = ("A", "B", "C")
"""Names of variants; more curves in one plot are not told apart."""


@dataclass(frozen=True, slots=True)
class Variant:
    """A setup that was kept."""

    letter: str
    """What it is called."""
    project: Project
    """The project as it was then."""


@dataclass(frozen=True, slots=True)
class VariantsState:
    """What was kept: the feature's part of the page's state."""

    kept: tuple[Variant, ...] = ()
    """In the order of their letters."""

    def variant(self, letter: str) -> Variant:
        """Return the variant of a letter; raises UsageError where there is none."""
        for each in self.kept:
            if each.letter == letter:
                return each
        known = ", ".join(each.letter for each in self.kept) or "none"
        raise UsageError(f"no variant is called {letter!r}; kept: {known}")


@reduce.register
def keep_variant(_action: KeepVariant, state: AppState, _sender: Sender) -> Outcome:
    """Keep the setup of now under the next free letter."""
    kept = state.part(VariantsState).kept
    free = [letter for letter in LETTERS if letter not in {each.letter for each in kept}]
    if not free:
        raise UsageError(f"{', '.join(LETTERS)} are kept already; forget one of them first (×)")
    every = sorted((*kept, Variant(free[0], state.project)), key=lambda each: each.letter)
    return Outcome(state.with_part(VariantsState(tuple(every))), (KeepRun(free[0]),))


@reduce.register
def drop_variant(action: DropVariant, state: AppState, _sender: Sender) -> Outcome:
    """Forget one."""
    gone = state.part(VariantsState).variant(action.letter)
    kept = tuple(each for each in state.part(VariantsState).kept if each is not gone)
    return Outcome(state.with_part(VariantsState(kept)), (DropRun(action.letter),))


@reduce.register
def use_variant(action: UseVariant, state: AppState, sender: Sender) -> Outcome:
    """Take its parameters and uncertainty: one undo step."""
    used = state.part(VariantsState).variant(action.letter).project
    project = replace(state.project, parameters=used.parameters, uncertainty=used.uncertainty)
    if (project.parameters, project.uncertainty) == (state.project.parameters, state.project.uncertainty):
        return Outcome(state)
    return Outcome(edited(state, project, Edit(f"use variant {action.letter}", sender)))
