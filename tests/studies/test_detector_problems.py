"""What the detector rejects is a problem of the site, with how many, of which and where."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from commission.site.parameters import DetectorParameters, Parameters
from commission.site.project import Project
from commission.site.reflectors import Reflector, ReflectorKind, ReflectorMap
from commission.site.scanner import Scanner
from commission.studies.detector_problems import detector_findings
from commission.studies.problems import ProblemsInput, Severity, Subject, problems
from tests.localization.test_beam_window import beams_of, passing, target_of

POSTS = ReflectorMap((Reflector(id="A", x=5.0, y=0.0), Reflector(id="B", x=0.0, y=4.0)))
WIDE = Scanner(resolution_deg=0.25, beam_width_deg=0.86, beam_aperture=0.008, reflector_range=10.0)
PRINTED = DetectorParameters(expected_beams="equation_3")


def test_rejections_are_told_with_their_share_and_distance() -> None:
    (lost,) = [each.text for each in detector_findings(POSTS, WIDE, PRINTED) if each.is_loss]
    found = re.match(r"The detector rejects (\d+) % of reflectors of radius 40 mm at ([\d.]+) m", lost)
    assert found
    share, distance = float(found[1]) / 100.0, float(found[2])
    # Against beams made of thin rays.
    shown, passed = passing(beams_of(0.86, 0.008, 0.25, 0.2), target_of(0.04, None, distance), model="equation_3")
    assert 1.0 - passed / shown == pytest.approx(share, abs=0.1)


def test_nothing_is_said_where_the_window_knows_the_beams() -> None:
    assert not [each for each in detector_findings(POSTS, WIDE, DetectorParameters()) if each.is_loss]
    assert not list(detector_findings(ReflectorMap(), WIDE, PRINTED))


def test_what_the_scanner_cannot_resolve_is_told() -> None:
    thin = Scanner(resolution_deg=0.5, beam_width_deg=0.1, reflector_range=20.0)
    losses = [each.text for each in detector_findings(POSTS, thin, DetectorParameters()) if each.is_loss]
    notes = [each.text for each in detector_findings(POSTS, thin, DetectorParameters()) if not each.is_loss]
    # 2 (asin(0.04 / d) + 0.05 - 0.02 deg) are 0.5 deg at 10.4 m, beyond which some scans miss it, with the noise of the
    # bearings a little sooner; and 1 deg at 4.9 m. The distances of the table are 7 % apart.
    (missed,) = losses
    assert "The beams miss" in missed
    assert float(re.findall(r"from ([\d.]+) m on", missed)[0]) == pytest.approx(10.4, rel=0.08)
    (few,) = notes
    assert float(re.findall(r"from ([\d.]+) m on", few)[0]) == pytest.approx(4.9, rel=0.08)


def test_plates_are_told_by_their_half_width_and_scanners_by_their_names() -> None:
    plates = ReflectorMap((Reflector(id="P", x=5.0, y=0.0, radius=0.1, kind=ReflectorKind.FLAT),))
    two = (replace(WIDE, name="front"), replace(WIDE, name="rear"))
    site = Project(reflectors=plates, scanners=two, parameters=Parameters(detector=PRINTED))
    found = [each for each in problems(ProblemsInput.of(site)).problems if "rejects" in each.text]
    assert [each.text.rsplit("(", 1)[1] for each in found] == ["scanner 'front')", "scanner 'rear')"]
    assert all("plates of half width 100 mm" in each.text for each in found)
    assert {(each.severity, each.subject) for each in found} == {(Severity.WARNING, Subject.SCANNER)}
