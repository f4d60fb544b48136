"""The command `simulate`: a virtual drive, written as the recording of a real vehicle, or sent as by a real one."""

from __future__ import annotations

import dataclasses
import shlex
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, UseAppendAction, arg

from commission.errors import UsageError

if TYPE_CHECKING:
    from commission.site.disturbances import CoveredPeriod, Disturbances
    from commission.site.project import Project
    from commission.site.records import Record

COVER_FORM = "START,DURATION (seconds)"


@dataclass(frozen=True, kw_only=True)
class Simulate:
    """Drive a virtual AGV along a route and write what it reports as a recording, ground truth included; or send it."""

    project: Positional[Path]
    """Folder of the project (holds project.yaml)."""
    out: Annotated[Path | None, arg(metavar="DIR|FILE.mcap")] = None
    """Folder for the recording, made when it does not exist, or an MCAP file. None: with --live, nothing is written."""
    route: Annotated[str | None, arg(metavar="NAME")] = None
    """Route to drive. None: the project's first."""
    seed: int = 1
    """Seed of every random number, 0 or more: the same seed gives the same recording, bit by bit."""
    faults: bool = True
    """Whether the project's disturbances act: people, shiny objects, glints, tilted floor, lost scans, wheel slips, and
    errors of survey, mounting, ranges, clock and wheels that are constant over a drive (drawn once for each seed, and
    written into the recording's truth.json). The noise of the wheels, `disturbances.wheels`, always acts."""
    people: Annotated[int | None, arg(metavar="N")] = None
    """People walking about. None: as many as the project says."""
    cover: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="START,DURATION")] = ()
    """A time during which all reflectors are covered: start and length [s]."""
    force: bool = False
    """Whether a recording that is there already is replaced."""
    live: Annotated[str | None, arg(metavar="PROTOCOL")] = None
    """Send the drive over the network instead, scans by this protocol: json, sick-safety, cola, nav350, compact or
    rosbridge. What a scanner does not say (odometry, the true pose) goes as JSON beside it."""
    address: Annotated[str | None, arg(metavar="HOST:PORT")] = None
    """Where to send to, or where the device is that is connected to (cola, nav350, rosbridge); of several scanners the
    next ones have the next ports. None: 127.0.0.1 and the usual port."""
    odometry: Annotated[str, arg(metavar="HOST:PORT")] = "127.0.0.1:6061"
    """Where what the scanner does not say goes."""
    speed: float = 1.0
    """Factor of a drive that is sent against real time, more than 0."""

    def run(self) -> None:
        """Simulate, write or send, and tell in a few lines what was, and what is true in it."""
        if self.seed < 0:
            raise UsageError(f"--seed is {self.seed}; expected 0 or more")
        if self.live is not None:
            self._send(self.live)
            return
        if self.out is None:
            raise UsageError(
                "neither --out nor --live is given; expected a folder to write to, or a protocol to send by"
            )

        from commission.io.project_file import load_project
        from commission.io.recordings.writers import refuse_to_write, write_records
        from commission.simulation.constants import draw_truth
        from commission.simulation.scenario import records
        from commission.site.truth import truth_lines

        refuse_to_write(self.out, force=self.force)
        project = load_project(self.project)
        route = self._route(project)
        project = dataclasses.replace(project, disturbances=self._disturbances(project))
        tally = _Tally()
        truth = draw_truth(project, route, self.seed)
        names = tuple(scanner.name for scanner in project.scanners)
        write_records(self.out, tally.count(records(project, route, self.seed)), truth, scanners=names)

        seconds = tally.last_ns * 1e-9
        sys.stdout.write(f"Drive        route {route!r}, {seconds:.1f} s, {tally.scans} scans, seed {self.seed}\n")
        sys.stdout.writelines(f"True         {line}\n" for line in truth_lines(truth))
        for text, period in zip(self.cover, map(_covered_period, self.cover), strict=True):
            if period.start >= seconds:
                why = f"begins after the end of the drive of {seconds:.1f} s: it covers nothing"
                sys.stdout.write(f"Note         --cover {text} {why}\n")
        sys.stdout.write(f"Written to   {self.out}\n")

    def _send(self, protocol: str) -> None:
        """Send the drive over the network until it is over, or interrupted."""
        if self.out is not None:
            raise UsageError("--out and --live are both given; expected one: who listens can record what arrives")

        from commission.io.live.registry import SourceAddress
        from commission.io.live.virtual_vehicle import addresses_of, send_drive
        from commission.io.project_file import load_project
        from commission.simulation.scenario import records

        project = load_project(self.project)
        route = self._route(project)
        project = dataclasses.replace(project, disturbances=self._disturbances(project))
        names = tuple(scanner.name for scanner in project.scanners)
        address = SourceAddress.parse(f"{protocol}:{self.address or ''}")
        addresses = addresses_of(address, names, SourceAddress.parse(f"json:{self.odometry}"))
        sources = " ".join(f"--source {shlex.quote(str(each))}" for each in addresses)
        sys.stdout.write(f"Listen with  commission serve {shlex.quote(str(self.project))} {sources}\n")
        sys.stdout.flush()
        sent = send_drive(records(project, route, self.seed), addresses, names, speed=self.speed)
        seconds = sent.seconds
        sys.stdout.write(f"Sent         route {route!r}, {seconds:.1f} s, {sent.scans} scans, seed {self.seed}\n")

    def _route(self, project: Project) -> str:
        """Name of the route to drive; raises UsageError when there is none."""
        if self.route is not None:
            return project.route(self.route).name
        if not project.routes:
            raise UsageError("the project has no route; expected one to drive along")
        return project.routes[0].name

    def _disturbances(self, project: Project) -> Disturbances:
        """Return what the drive suffers; raises UsageError for a number out of range."""
        disturbances = project.disturbances if self.faults else project.disturbances.undisturbed()
        covered = (*disturbances.covered, *(_covered_period(text) for text in self.cover))
        people = disturbances.people if self.people is None else self.people
        try:
            return dataclasses.replace(disturbances, people=people, covered=covered)
        except ValueError as error:
            raise UsageError(str(error)) from None


@dataclass
class _Tally:
    """What has passed on its way from the simulation to the file: a whole drive is never held in memory."""

    scans: int = 0
    """Scans so far."""
    last_ns: int = 0
    """Stamp of the last record [ns]; a drive begins at 0."""

    def count(self, records: Iterable[Record]) -> Iterator[Record]:
        """Pass records on and count them."""
        from commission.site.records import Scan

        for record in records:
            self.scans += isinstance(record, Scan)
            self.last_ns = record.stamp_ns
            yield record


def _covered_period(text: str) -> CoveredPeriod:
    """Read `START,DURATION`; raises UsageError that shows the text and the form expected."""
    from commission.site.disturbances import CoveredPeriod

    words = text.split(",")
    if len(words) != 2:
        raise UsageError(f"--cover is {text!r}; expected {COVER_FORM}")
    try:
        return CoveredPeriod(float(words[0]), float(words[1]))
    except ValueError as error:
        raise UsageError(f"--cover is {text!r}: {error}; expected {COVER_FORM}") from None
