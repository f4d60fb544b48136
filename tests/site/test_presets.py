from __future__ import annotations

import pytest

from commission.errors import UsageError
from commission.site.presets import SCANNERS, Origin, with_preset
from commission.site.scanner import Scanner


@pytest.mark.parametrize(
    ("name", "beams"),
    # Beams of one scan: telegrams and manuals of the devices; 275 deg / 0.39 deg for the microScan3.
    [
        ("SICK microScan3", 706),
        ("SICK nanoScan3", 1651),
        ("SICK S300", 541),
        ("SICK TiM781", 811),
        ("SICK NAV350", 1440),
        ("Hokuyo UAM-05LP", 1081),
        ("Pepperl+Fuchs R2000", 3600),
    ],
)
def test_a_preset_has_the_beams_of_its_device(name, beams):
    assert with_preset(Scanner(), name).beam_count == beams


@pytest.mark.parametrize("preset", SCANNERS, ids=lambda preset: preset.name)
def test_every_figure_of_a_preset_says_where_it_comes_from(preset):
    origins = preset.origins()
    assert preset.quoted | preset.read <= set(origins)
    assert not preset.quoted & preset.read
    # Nobody publishes the 1-sigma noise of a bearing or how far a reflector on a vehicle's course is told apart.
    assert origins["bearing_sigma_deg"] is Origin.ASSUMED
    assert origins["resolution_deg"] is not Origin.ASSUMED
    assert "quoted" in preset.source


def test_a_preset_leaves_the_scanner_where_it_is_mounted():
    assert with_preset(Scanner(mounting=[0.4, 0.0, 0.1]), "SICK S300").mounting.tolist() == [0.4, 0.0, 0.1]
    with pytest.raises(UsageError, match="no scanner preset is called 'LMS'; expected one of: SICK microScan3"):
        with_preset(Scanner(), "LMS")
