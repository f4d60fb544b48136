"""The runs of variants: kept as they were, localized again over another drive, and compared in the background."""

from __future__ import annotations

from commission.app.base.effects import Effect
from commission.app.base.service import Context
from commission.app.base.state import AppState
from commission.app.run.variant_actions import DropRun, KeepRun
from commission.app.run.variant_reducer import VariantsState
from commission.app.run.view import KeptRun
from commission.progress import Progress
from commission.studies.run import RunInput, RunResult, judged_run
from commission.studies.variants import VariantsInput, VariantsResult, variants

NOW = "Now"
"""What the run that is shown is called among its variants."""
COMPARE = "Comparing variants"


class VariantRuns:
    """Runs that were kept; called by the owner thread alone.

    Parameters
    ----------
    context : what the service of the run is made with.
    """

    def __init__(self, context: Context) -> None:
        self._jobs = context.jobs
        self._runs: dict[str, RunResult] = {}
        self._shown: RunResult | None = None
        self._state = context.state
        self.compared: VariantsResult | None = None
        """The variants of the drive that is shown; none before two are known."""

    @property
    def kept(self) -> tuple[KeptRun, ...]:
        """Those over the drive that was shown last, as a whole."""
        return () if self._shown is None else self.kept_over(self._shown)

    def kept_over(self, shown: RunResult) -> tuple[KeptRun, ...]:
        """Return those over the drive of a run; none over one that a vehicle is driving."""
        same = (item for item in sorted(self._runs.items()) if item[1].inputs.log is shown.inputs.log)
        return tuple(KeptRun(letter, run) for letter, run in same)

    def compared_over(self, shown: RunResult) -> VariantsResult | None:
        """Return what was compared over the drive of a run."""
        known = self.compared
        return known if known is not None and known.inputs.runs[0].inputs.log is shown.inputs.log else None

    def carry_out(self, effect: Effect, wanted: RunInput | None, state: AppState) -> None:
        """Keep the run that is wanted or let one go; other effects are not for variants.

        Parameters
        ----------
        effect : what is to be done.
        wanted : what the run is to be made of; none before there is a drive.
        state : of the page, as it follows.
        """
        match effect:
            case KeepRun(letter):
                self.keep(letter, wanted, state)
            case DropRun(letter):
                self.drop(letter, state)
            case _:
                pass

    def keep(self, letter: str, wanted: RunInput | None, state: AppState) -> None:
        """Keep a run, as it is shown, or as soon as it is known where something else is wanted already.

        Parameters
        ----------
        letter : what it is called.
        wanted : what the run is to be made of; none before there is a drive.
        state : of the page, with the variant in it.
        """
        self._state, shown = state, self._shown
        if wanted is None or shown is None or wanted.log is not shown.inputs.log:
            return
        if wanted == shown.inputs:
            self._runs[letter] = shown
            self._compare()
        else:
            self._localize(letter, wanted, shown)

    def drop(self, letter: str, state: AppState) -> None:
        """Let a run go; `state` is that without the variant."""
        self._runs.pop(letter, None)
        self._state = state
        self._jobs.cancel(_key(letter))
        self._compare()

    def take(self, result: RunResult) -> None:
        """Compare with another run; where its drive is another one, variants are localized over that first."""
        self._shown = result
        for variant in self._state.part(VariantsState).kept:
            run = self._runs.get(variant.letter)
            if run is None or run.inputs.log is not result.inputs.log:
                inputs = RunInput.of(variant.project, result.inputs.log, result.inputs.start)
                self._localize(variant.letter, inputs, result)
        self._compare()

    def _localize(self, letter: str, inputs: RunInput, earlier: RunResult) -> None:
        """Localize one of them over the drive that is shown."""

        def keep(run: RunResult) -> None:
            self._runs[letter] = run
            self._compare()

        self._jobs.start(
            f"Localizing variant {letter}",
            lambda progress: judged_run(inputs, progress, earlier=earlier),
            then=keep,
            key=_key(letter),
        )

    def _compare(self) -> None:
        """Compare what there is; until that is done the table shows what was compared before."""
        shown, kept = self._shown, self.kept
        if shown is None or not kept:
            self._jobs.cancel(COMPARE)
            self.compared = None
            return
        inputs = VariantsInput(names=(NOW, *(each.letter for each in kept)), runs=(shown, *(e.run for e in kept)))

        def compare(progress: Progress) -> VariantsResult:
            return variants(inputs, progress)

        self._jobs.start(COMPARE, compare, then=self._keep, is_shown=False)

    def _keep(self, compared: VariantsResult) -> None:
        self.compared = compared


def _key(letter: str) -> tuple[str, str]:
    return ("variant", letter)
