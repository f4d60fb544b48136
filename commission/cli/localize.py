"""The command `localize`: a recording through the localizer, its estimates and a summary into a folder."""

from __future__ import annotations

import dataclasses
import math
import sys
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import Positional, UseAppendAction, arg

from commission.cli.parsing import initial_pose, reference_antenna
from commission.errors import UsageError
from commission.site.quantity import MILLIMETRES, PERCENT, PLAIN_DEGREES, counted_text

if TYPE_CHECKING:
    from collections.abc import Generator, Sequence

    from commission.site.project import Project
    from commission.site.record_log import RecordLog
    from commission.studies.consistency import Consistency
    from commission.studies.detection_rates import DetectionRate
    from commission.studies.run import RunResult
    from commission.studies.sections import Section


@dataclass(frozen=True, kw_only=True)
class Localize:
    """Run the localizer over a recording; writes estimates, detections, events, reflectors (.csv) and summary.json."""

    project: Positional[Path]
    """Folder of the project (holds project.yaml)."""
    recording: Positional[Path]
    """Recording: a CSV folder (odometry.csv with detections.csv or scans.npz), a ROS bag (.mcap, .db3, .bag)
    or a capture (.pcap, .pcapng)."""
    out: Annotated[Path, arg(metavar="DIR")]
    """Folder for the results; made when it does not exist."""
    initial_pose: Annotated[str | None, arg(metavar="X,Y,THETA[,SX,SY,STHETA]|auto")] = None
    """Pose of base at the first record and its 1-sigma, map frame [m, m, rad]; auto: it is looked for in the whole map
    by what is seen. None: as a recording of the page says, else the first reference pose, else the start of the
    project's first route, with 1-sigma 0.02 m and 0.01 rad, else auto."""
    reference_antenna: Annotated[str | None, arg(metavar="X,Y[,Z]")] = None
    """Point of the vehicle whose place the reference measures, base frame [m]. None: as the recording's reference.json
    says, else base."""
    reference_clock: Annotated[float | None, arg(metavar="S")] = None
    """How much later than they were measured the reference's poses are stamped [s]. None: as reference.json says."""
    set: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="GROUP.KEY=VALUE")] = ()
    """A parameter of the localizer in place of the project's, in SI units and radians."""
    force: bool = False
    """Whether files in DIR that this command did not write are overwritten; its own earlier results always are."""

    detection_rates: bool = False
    """Tell in how many scans reflectors in free sight are seen, by their distance; also in summary.json."""
    rated_project: Annotated[Path | None, arg(metavar="PROJECT2")] = None
    """Folder for the project with these shares as its scanners' detection_rates, and reflector_range out to where one
    is seen; made when it does not exist."""
    vda5050: Annotated[Path | None, arg(metavar="FILE")] = None
    """File for state messages of VDA 5050, one JSON object a line: at each change of the mode and about each second,
    with a LOCALIZATION_ERROR exactly while the vehicle is not operational. What a localizer does not know is empty."""
    vda5050_version: Literal["2.1.0", "3.0.0"] = "2.1.0"
    """Version of these messages."""
    vda5050_map_id: Annotated[str | None, arg(metavar="ID")] = None
    """Identification of the map in these messages, as the orders have it. None: the project's name."""
    strict: bool = False
    """Refuse a recording that cannot be what it says (units, clocks, gaps, thresholds) instead of noting it."""

    channel: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="KIND=TOPIC")] = ()
    """ROS bag with several candidates: the topic of scan (or scan.NAME, for each of several scanners), odometry or
    reference; the topic none: of no topic. Repeat it for several."""
    wheels: Annotated[str | None, arg(metavar="LEFT,RIGHT,RADIUS,SEPARATION[,TICKS]")] = None
    """ROS bag whose odometry is a JointState: names of the two driven wheels, their radius and distance [m], and counts
    for one turn where they are no radians."""

    def run(self) -> None:
        """Localize, write, and tell in a few lines how it went."""
        searched = self.initial_pose == "auto"
        given = None if self.initial_pose is None or searched else initial_pose(self.initial_pose)

        from commission.errors import SourceError
        from commission.io.overwriting import result_folder
        from commission.io.project_file import load_project
        from commission.io.recordings.base import load_log
        from commission.io.recordings.channels import ChannelOptions
        from commission.io.results import (
            RESULTS,
            write_events,
            write_protection,
            write_reflector_figures,
            write_results,
        )
        from commission.localization import whole_run
        from commission.site.truth import truth_lines
        from commission.studies.detection_rates import rate_entries, rate_told
        from commission.studies.events import EventsInput, events
        from commission.studies.integrity import protection, protection_entries
        from commission.studies.plausibility import PlausibilityInput, has_motion, plausibility
        from commission.studies.reflector_figures import ReflectorFiguresInput, reflector_figures
        from commission.studies.run import RunInput, judged_run, summary
        from commission.studies.run_findings import run_findings
        from commission.studies.scanner_figures import figures_entries
        from commission.studies.sections import section_entries, sections
        from commission.studies.start import start_of, unknown_start

        sources = (self.recording, self.project)
        out = result_folder(self.out, "localize", RESULTS, force=self.force, sources=sources)
        self._refuse_to_overwrite()
        project = as_saved = load_project(self.project)
        project = self._with_settings(project)
        log = self._with_reference(load_log(self.recording, ChannelOptions.parse(self.channel, self.wheels)))
        if not has_motion(log):
            found = "holds no odometry: between scans nobody knows where the vehicle went"
            raise SourceError(f"{self.recording} {found}; expected odometry, in a bag by --channel odometry=TOPIC")
        start = (
            unknown_start(project, log)
            if searched
            else start_of(project, log, given and given.pose, given and given.sigmas)
        )
        if self.strict:
            for finding in plausibility(PlausibilityInput.of(project, log)):
                raise SourceError(f"{self.recording}: {finding}")

        whole_run.warm_up()
        result = judged_run(RunInput.of(project, log, start))
        cut = sections(result.columns, project.stations)
        findings = [*log.notes, *(str(finding) for finding in run_findings(result))]

        levels, rates = protection(result.columns), self._rates(project, result)
        protected = protection_entries(result, levels)
        more = protected | {
            "scanners": figures_entries(result.scanners),
            "sections": section_entries(cut),
            "findings": findings,
            **({"detection_rates": rate_entries(rates)} if rates else {}),
        }
        rated = self._rate(as_saved, project, result, rates)
        with out.writing() as folder:
            write_results(folder, result.columns, summary(result) | more)
            write_events(folder, events(EventsInput(result)))
            write_reflector_figures(folder, reflector_figures(ReflectorFiguresInput.of(result, project.floor_map)))
            write_protection(folder, result, levels)
        true = [] if log.truth is None else [f"True         {line}" for line in truth_lines(log.truth)]
        lines = [*_report(result, cut), _protected(protected), *map(rate_told, rates), *rated, *true]
        lines += [*(f"Note         {finding}" for finding in findings), *self._messages(project, result)]
        sys.stdout.write("\n".join([*lines, f"Written to   {self.out}"]) + "\n")

    def _rates(self, project: Project, result: RunResult) -> tuple[DetectionRate, ...]:
        """Count how often reflectors are seen, where that is asked for."""
        from commission.studies.detection_rates import detection_rates

        return detection_rates(project, result.columns) if self.detection_rates or self.rated_project else ()

    def _messages(self, project: Project, result: RunResult) -> list[str]:
        """Write the state messages, where that is asked for, and tell how many they are."""
        if self.vda5050 is None:
            return []
        from commission.io.vda5050_states import StateVersion, write_states

        map_id = project.name if self.vda5050_map_id is None else self.vda5050_map_id
        count = write_states(self.vda5050, result, map_id, StateVersion(self.vda5050_version))
        return [f"VDA 5050     {count} state messages in {self.vda5050}"]

    def _refuse_to_overwrite(self) -> None:
        """Raise UsageError where the project with the counted rates, or the messages, cannot be written."""
        from commission.io.overwriting import refuse_files
        from commission.io.project_copy import refuse_to_replace

        if self.vda5050 is not None:
            for name, folder in (("results", self.out), ("recording", self.recording), ("project", self.project)):
                if self.vda5050.resolve().is_relative_to(folder.resolve()):
                    raise UsageError(
                        f"--vda5050 {self.vda5050} is among the {name} in {folder}; expected another place"
                    )
            refuse_files(self.vda5050, force=self.force)
        if self.rated_project is not None:
            if self.rated_project.resolve() == self.project.resolve():
                raise UsageError(f"--rated-project is the project itself, {self.project}; expected another folder")
            refuse_to_replace(self.rated_project, force=self.force)

    def _rate(
        self, as_saved: Project, project: Project, result: RunResult, rates: Sequence[DetectionRate]
    ) -> list[str]:
        """Write the project with the counted rates, where that is asked for, and tell of each scanner."""
        if self.rated_project is None:
            return []
        from commission.io.project_copy import save_copy
        from commission.studies.rated_scanners import rated_scanners, rated_told

        scanners = rated_scanners(project, result.columns, rates)
        kept = save_copy(dataclasses.replace(as_saved, scanners=scanners), self.rated_project, force=self.force)
        notes = [] if kept is None else [f"Note         unsaved edits of the project that was there are kept in {kept}"]
        told = map(rated_told, as_saved.scanners, scanners)
        return [*told, *notes, f"Rated        {self.rated_project}"]

    def _with_settings(self, project: Project) -> Project:
        """Return the project with the parameters that are set; raises UsageError where its floor cannot serve them."""
        from commission.io.project_file import apply_settings

        parameters = apply_settings(project.parameters, self.set)
        if parameters.contour.enabled and project.floor_map is None:
            raise UsageError(f"contour.enabled is true and {self.project} has no floor map; expected one with walls")
        return dataclasses.replace(project, parameters=parameters)

    def _with_reference(self, log: RecordLog) -> RecordLog:
        """Return the log with a reference that measures where the options say."""
        mount = log.reference_mount
        if self.reference_antenna is not None:
            with _named("--reference-antenna"):
                mount = dataclasses.replace(mount, antenna=reference_antenna(self.reference_antenna))
        if self.reference_clock is not None:
            with _named("--reference-clock"):
                mount = dataclasses.replace(mount, clock_offset=self.reference_clock)
        return dataclasses.replace(log, reference_mount=mount)


@contextmanager
def _named(option: str) -> Generator[None]:
    """Let a refusal of a value say which option it came by."""
    try:
        yield
    except ValueError as error:
        raise UsageError(f"{option}: {error}") from None


def _report(result: RunResult, cut: Sequence[Section]) -> list[str]:
    """Lines that tell a person how the run went; millimetres and degrees as is the habit."""
    limit = result.inputs.segments[0].setup.parameters.supervisor.position_limit
    lines = [
        f"Recording    {result.cycles} cycles in {result.duration:.1f} s",
        f"Start        {_start(result)}",
        *(_of_scans(result) if result.columns.has_scans else ()),
        *_by_bearings(result),
        *_by_section(cut),
        *_by_scanner(result),
        *_by_goods(result),
        f"Supervisor   operational {PERCENT.text(result.operational_fraction, '.1f')}, lost "
        f"{PERCENT.text(result.lost_fraction, '.1f')}; fail episodes: {len(result.episodes)}"
        + "".join(_longest(result)),
    ]
    errors = result.statistics
    if errors is None:
        return [*lines, "Reference    none: errors are unknown"]
    heading = (
        "" if math.isnan(errors.heading_rmse) else f"; heading {PLAIN_DEGREES.text(errors.heading_rmse, '.2f')} RMS"
    )
    rms, median, p95, most = (
        MILLIMETRES.number(error, ".1f")
        for error in (errors.position_rmse, errors.position_median, errors.position_p95, errors.position_max)
    )
    consistency = "" if math.isnan(errors.anees) else f"{errors.anees:.2f}, of the "
    outside, in_gap = result.without_reference
    return [
        *lines,
        f"Reference    for {errors.compared} of {result.cycles} cycles; {outside} are outside of its time, {in_gap} in "
        f"its gaps{_mounted(result)}",
        f"Error        position {rms} mm RMS, {median} median, {p95} at 95 %, {most} at most{heading}",
        f"Consistency  ANEES {consistency}position {errors.anees_position:.2f} (1 is consistent, more is too sure)",
        f"Danger       {errors.wrong_while_operational} of {errors.compared} cycles operational with an error "
        f"beyond {MILLIMETRES.text(limit)}",
    ]


def _protected(told: dict[str, Any]) -> str:
    """How large the error can be at most, how often that is within the limits, and how often the error was beyond."""
    median, p95 = (
        "none" if value is None else MILLIMETRES.text(value, ".1f")
        for value in (told["protection_position_median_m"], told["protection_position_p95_m"])
    )
    beyond = (
        f"; error beyond it in {counted_text(told['beyond_protection'], 'cycle')}"
        if "beyond_protection" in told
        else ""
    )
    return (
        f"Protection   position {median} median, {p95} at 95 %, at a risk of {told['integrity_risk']:g} per cycle; "
        f"within the limits {PERCENT.text(told['protected_fraction'] or 0.0, '.1f')}{beyond}"
    )


def _nis(fits: Consistency) -> str:
    """How far detections lie from their reflectors; in words where there are none."""
    if math.isnan(fits.nis_before_gate_mean):
        return "none: no detection lies near a reflector"
    accepted = (
        "of the accepted: there is none"
        if math.isnan(fits.nis_mean)
        else f"mean {fits.nis_mean:.2f} of the accepted ({fits.nis_expected:.2f} is consistent)"
    )
    return (
        f"{accepted}, {fits.nis_before_gate_mean:.2f} of all near a reflector; "
        f"{_known(PERCENT.of(fits.rejected_fraction), 1)} % rejected"
    )


def _start(result: RunResult) -> str:
    """Where the run starts and who says so; a vehicle that looks for itself: where and when it was found."""
    import numpy as np

    from commission.localization.estimate import Mode
    from commission.studies.start import StartOrigin

    start = result.inputs.start
    (x, y, theta), when = start.belief.mean, ""
    if start.origin is StartOrigin.SEARCH:
        found = np.flatnonzero(result.columns.modes != Mode.INITIALIZING)
        if not len(found):
            return f"{start.origin.value}; not found"
        x, y, theta = result.columns.means[found[0]]
        when = f"; found after {result.times[found[0]]:.1f} s"
    return f"x {x:.3f} m, y {y:.3f} m, heading {PLAIN_DEGREES.text(theta, '.1f')} ({start.origin.value}{when})"


def _known(figure: float, digits: int = 2) -> str:
    """A figure of detections, of which there may be none."""
    return "unknown" if math.isnan(figure) else f"{figure:.{digits}f}"


def _mounted(result: RunResult) -> str:
    """Where the reference measures, if not at base by the recording's clock."""
    from commission.site.reference_mount import BASE

    mount = result.inputs.log.reference_mount
    return "" if mount == BASE else f"; {mount.told()}"


def _seconds(seconds: float) -> str:
    """A time as it is read; one shorter than a second with two decimals, so that one scan is not none."""
    return f"{seconds:.1f} s" if seconds >= 1.0 or seconds == 0.0 else f"{seconds:.2f} s"


def _by_section(cut: Sequence[Section]) -> list[str]:
    """A line for each section between stations, where any is passed."""
    if len(cut) == 1:
        return []
    return [
        f"Section      {each.begin} to {each.end}, {each.from_s:.1f} to {each.to_s:.1f} s: NIS "
        f"{_known(each.figures.nis_before_gate_mean)} of all near a reflector, "
        f"{_known(PERCENT.of(each.figures.rejected_fraction), 1)} % rejected; unseen "
        f"{PERCENT.text(each.figures.unseen_fraction, '.1f')} of the cycles, "
        f"{_seconds(each.figures.longest_unseen)} at most"
        for each in cut
    ]


def _by_scanner(result: RunResult) -> list[str]:
    """A line for each scanner of a vehicle with several."""
    from commission.studies.scanner_figures import told

    if len(result.scanners) == 1:
        return []
    return [f"Scanner      {each.name}: {told(each)}" for each in result.scanners]


def _of_scans(result: RunResult) -> list[str]:
    """Lines about what scans saw of reflectors."""
    from commission.localization.estimate import Status

    fits = result.consistency
    return [
        f"Detections   {result.count(Status.INLIER)} inliers, "
        f"{result.count(Status.OUTLIER_DETECTOR)} outliers of the detector, "
        f"{result.count(Status.OUTLIER_ASSOCIATION)} of the association",
        f"NIS          {_nis(fits)}",
        f"Unseen       {_known(PERCENT.of(fits.unseen_fraction), 1)} % of the cycles without an accepted detection, "
        f"{_seconds(fits.longest_unseen)} at most",
    ]


def _by_bearings(result: RunResult) -> list[str]:
    """A line about bearings of a goniometer, where the recording has any."""
    from commission.studies.bearing_figures import bearing_figures

    told = bearing_figures(result.columns)
    if not told:
        return []
    nis = told["bearing_nis_before_gate_mean"]
    fits = "" if nis is None else f"; NIS {nis:.2f} with the rejected ones (1 is consistent)"
    return [
        f"Bearings     {told['bearings']}: {told['bearing_accepted']} accepted, {told['bearing_rejected']} rejected, "
        f"{told['bearing_unknown']} of two reflectors or of none of the map{fits}"
    ]


def _by_goods(result: RunResult) -> list[str]:
    """A line about temporary landmarks, where they are looked at."""
    from commission.studies.temporary_figures import temporary_figures

    told = temporary_figures(result.columns)
    if not told:
        return []
    nis = told["temporary_nis_per_row_mean"]
    fits = "" if nis is None else f", NIS {nis:.2f} of each row (1 is consistent)"
    return [
        f"Temporary    {told['temporary_matched']} sightings of landmarks{fits}; {told['temporary_born']} born, "
        f"{told['temporary_forgotten']} forgotten, {told['temporary_known_max']} known at most"
    ]


def _longest(result: RunResult) -> list[str]:
    """How long the longest fail episode is, if there is one."""
    lengths = [(episode.end_ns - episode.start_ns) * 1e-9 for episode in result.episodes]
    return [f", the longest {max(lengths):.1f} s"] if lengths else []
