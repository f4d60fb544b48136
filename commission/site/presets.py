"""Scanners that are common on vehicles, as starting points: each figure says where it comes from.

A preset is not a data sheet: variants of a device differ, and what counts is measured on the vehicle (`calibrate`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from enum import StrEnum
from types import MappingProxyType
from typing import Any

from commission.errors import UsageError
from commission.site.scanner import Scanner


class Origin(StrEnum):
    """Where a figure comes from."""

    DOCUMENT = "document"
    """Read in the named document of the manufacturer."""
    QUOTED = "quoted"
    """The manufacturer's figure as drivers and other public sources quote it; compare it with your data sheet."""
    ASSUMED = "assumed"
    """No published figure: a cautious value of ours. Measure it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ScannerPreset:
    """One scanner as delivered, mounted nowhere yet."""

    name: str
    """Manufacturer and type."""
    scanner: Scanner
    """Its values; the mounting is that of a scanner in the middle of the vehicle, looking ahead."""
    source: str
    """Documents and other sources of the figures."""
    quoted: frozenset[str]
    """Fields of the scanner whose figure is `Origin.QUOTED`."""
    read: frozenset[str] = frozenset()
    """Fields of the scanner whose figure is `Origin.DOCUMENT`."""

    def origin(self, field: str) -> Origin:
        """Where the figure of a field comes from."""
        if field in self.read:
            return Origin.DOCUMENT
        return Origin.QUOTED if field in self.quoted else Origin.ASSUMED

    def origins(self) -> Mapping[str, Origin]:
        """Where each figure comes from, by the names of the scanner's fields that are its figures."""
        names = (field.name for field in fields(Scanner) if field.name in FIGURES)
        return MappingProxyType({name: self.origin(name) for name in names})


FIGURES = frozenset(
    {
        "field_of_view_deg",
        "resolution_deg",
        "rate",
        "range",
        "range_sigma",
        "bearing_sigma_deg",
        "beam_width_deg",
        "beam_aperture",
        "reflector_range",
        "detection_rates",
    }
)
"""Fields of a scanner that a preset sets; the others say how it is built into the vehicle. No maker publishes in how
many scans a reflector is seen: a preset leaves the table of detection rates empty, since that of another device says
nothing."""
_GEOMETRY = frozenset({"field_of_view_deg", "resolution_deg", "rate", "range"})

SCANNERS: tuple[ScannerPreset, ...] = (
    ScannerPreset(
        name="SICK microScan3",
        scanner=Scanner(
            field_of_view_deg=(-137.5, 137.5),
            resolution_deg=0.39,
            rate=25.0,
            range=(0.1, 40.0),
            range_sigma=0.02,
            bearing_sigma_deg=0.1,
            beam_width_deg=0.4,
            reflector_range=20.0,
        ),
        source="Scan of 275 deg, 0.39 deg at a scan cycle time of 40 ms (0.51 deg at 30 ms), distances up to 40 m: "
        "operating instructions microScan3 Core I/O (8025870) and data output (8022708), as quoted. Variants "
        "with a protective field of 9 m scan finer.",
        quoted=_GEOMETRY,
    ),
    ScannerPreset(
        name="SICK nanoScan3",
        scanner=Scanner(
            field_of_view_deg=(-137.5, 137.5),
            resolution_deg=1.0 / 6.0,
            rate=1000.0 / 30.0,
            range=(0.05, 40.0),
            range_sigma=0.02,
            bearing_sigma_deg=0.05,
            beam_width_deg=0.3,
            reflector_range=15.0,
        ),
        source="1,651 beams over 275 deg, scan cycle time 30 ms, 40 m for no echo: telegrams of a real device (data "
        "output 8022708); near range of 50 mm: operating instructions nanoScan3 I/O, as quoted.",
        quoted=_GEOMETRY,
    ),
    ScannerPreset(
        name="SICK S300",
        scanner=Scanner(
            field_of_view_deg=(-135.0, 135.0),
            resolution_deg=0.5,
            rate=12.5,
            range=(0.1, 30.0),
            range_sigma=0.03,
            bearing_sigma_deg=0.1,
            beam_width_deg=0.5,
            reflector_range=15.0,
        ),
        source="270 deg, 0.5 deg, basic response time 80 ms, distances up to 30 m: operating instructions S300 "
        "(8010948), as quoted.",
        quoted=_GEOMETRY,
    ),
    ScannerPreset(
        name="SICK TiM781",
        scanner=Scanner(
            field_of_view_deg=(-135.0, 135.0),
            resolution_deg=1.0 / 3.0,
            rate=15.0,
            range=(0.05, 25.0),
            range_sigma=0.02,
            bearing_sigma_deg=0.1,
            beam_width_deg=0.49,
            reflector_range=20.0,
        ),
        source="270 deg in steps of 0.33 deg: operating instructions TiM781 (8024231, 2019), section 7.3. 811 beams "
        "at 15 Hz, 0.05 to 25 m: data sheet of part 1096807, as quoted. Beam width: that of the smaller "
        "TiM3xx, 8.6 mrad (8024851, section 3.6.4).",
        quoted=frozenset({"rate", "range"}),
        read=frozenset({"field_of_view_deg", "resolution_deg"}),
    ),
    ScannerPreset(
        name="SICK NAV350",
        scanner=Scanner(
            field_of_view_deg=(-180.0, 180.0),
            resolution_deg=0.25,
            rate=8.0,
            range=(0.5, 70.0),
            range_sigma=0.015,
            bearing_sigma_deg=0.05,
            beam_width_deg=0.286,
            beam_aperture=0.02,
            reflector_range=70.0,
        ),
        source="0.5 to 70 m and a beam of 20 mm that widens by 5.0 mrad: operating instructions NAV350 (8013889, "
        "2017), section 3.10.3 and table 8; 1,440 beams of 0.25 deg at 8 Hz: telegram listing (8013892), as quoted.",
        quoted=frozenset({"field_of_view_deg", "resolution_deg", "rate"}),
        read=frozenset({"range", "beam_width_deg", "beam_aperture"}),
    ),
    ScannerPreset(
        name="Hokuyo UAM-05LP",
        scanner=Scanner(
            field_of_view_deg=(-135.0, 135.0),
            resolution_deg=0.25,
            rate=1000.0 / 30.0,
            range=(0.1, 20.0),
            range_sigma=0.03,
            bearing_sigma_deg=0.1,
            beam_width_deg=0.3,
            reflector_range=10.0,
        ),
        source="1,081 steps of 0.25 deg over 270 deg, a scan in 30 ms, warning zone up to 20 m: data sheet "
        "UAM-05LP-T301 and its communication protocol, as quoted.",
        quoted=_GEOMETRY,
    ),
    ScannerPreset(
        name="Pepperl+Fuchs R2000",
        scanner=Scanner(
            field_of_view_deg=(-180.0, 180.0),
            resolution_deg=0.1,
            rate=20.0,
            range=(0.1, 30.0),
            range_sigma=0.012,
            bearing_sigma_deg=0.03,
            beam_width_deg=0.1,
            reflector_range=30.0,
        ),
        source="360 deg, 10 to 50 scans and up to 250,000 measurements per second (here 3,600 at 20 Hz), 30 m "
        "(OMD30M-R2000): data sheet 232934 and Ethernet protocol, as quoted.",
        quoted=_GEOMETRY,
    ),
)
"""Presets in the order in which they are offered."""


def with_preset(scanner: Scanner, name: str) -> Scanner:
    """Scanner with the figures of a preset, built in like the given one; raises UsageError that lists the presets.

    Of blind sectors, what lies outside of the other field of view goes.
    """
    for preset in SCANNERS:
        if preset.name == name:
            figures: dict[str, Any] = {name: getattr(preset.scanner, name) for name in FIGURES}
            first, last = figures["field_of_view_deg"]
            inside = ((max(low, first), min(high, last)) for low, high in scanner.blind_sectors_deg)
            figures["blind_sectors_deg"] = tuple((low, high) for low, high in inside if low < high)
            return replace(scanner, **figures)
    known = ", ".join(preset.name for preset in SCANNERS)
    raise UsageError(f"no scanner preset is called {name!r}; expected one of: {known}")
