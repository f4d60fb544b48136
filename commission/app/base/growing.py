"""A run that grows while the vehicle drives: who hears of one says so here, and who shows runs takes it."""

from __future__ import annotations

from dataclasses import dataclass

from commission.app.base.actions import Action
from commission.localization.estimate import Belief, Mode
from commission.studies.run import RunResult


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RunGrew(Action):
    """A live run has more cycles than before, or its vehicle was not heard of for longer."""

    result: RunResult
    """The run so far; of a long one, the newest hour or two."""
    belief: Belief
    """What is known of the pose now."""
    mode: Mode
    """State of the supervisor."""
    is_over: bool = False
    """Whether nothing more comes."""
    of: object = None
    """Which live run it is; None: the one whose start it has."""

    @property
    def which(self) -> object:
        """Which live run it is, told from others by identity."""
        return self.result.inputs.start if self.of is None else self.of

    def supersedes(self, earlier: Action) -> bool:
        """Whether an earlier state of it need not be shown."""
        return isinstance(earlier, RunGrew)
