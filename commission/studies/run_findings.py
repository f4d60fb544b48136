"""What looks wrong about a run, in words: the recording before it was localized, and what localizing it says."""

from __future__ import annotations

from commission.progress import Progress, part, silent
from commission.studies.bearing_figures import bearing_findings
from commission.studies.consistency_findings import noise_findings
from commission.studies.contour_figures import contour_findings
from commission.studies.displaced import misplaced_findings
from commission.studies.misfit import MisfitInput, misfit
from commission.studies.plausibility import Finding, PlausibilityInput, plausibility
from commission.studies.run import RunResult
from commission.studies.tag_figures import tag_findings
from commission.studies.temporary_figures import temporary_findings

JUDGED_BEFORE = 0.2
"""Share of the progress of what is judged before localizing."""


def recording_input(result: RunResult) -> PlausibilityInput:
    """Return what is read to judge the recording of a run."""
    setup = result.inputs.segments[0].setup
    return PlausibilityInput(
        log=result.inputs.log,
        scanners=setup.scanners,
        detector=setup.parameters.detector,
    )


def run_findings(result: RunResult, progress: Progress = silent) -> tuple[Finding, ...]:
    """Judge a run that is done.

    Parameters
    ----------
    result : the run; what its first setup says about scanner and thresholds is held against the recording.
    progress : told which check is done; may raise to cancel.

    Returns
    -------
    findings : none where nothing looks wrong.
    """
    inputs = MisfitInput(
        log=result.inputs.log,
        setup=result.inputs.segments[0].setup,
        initial=result.inputs.start.state(),
        run=result.columns,
    )
    before = plausibility(recording_input(result), part(progress, 0.0, JUDGED_BEFORE))
    found = misfit(inputs, part(progress, JUDGED_BEFORE, 1.0))
    shape = misplaced_findings(result)
    # A factor of the noise says little where the setup itself is another one, or the map.
    noise = noise_findings(result.columns) if not found and not shape else ()
    columns = result.columns
    kinds = (*contour_findings(columns), *tag_findings(columns), *bearing_findings(columns))
    kinds = (*kinds, *temporary_findings(columns))
    return (*before, *found, *shape, *noise, *kinds)
