"""The virtual world on the page: each number has one widget, in its unit; an edit is undone, and tunes nothing."""

from __future__ import annotations

import dataclasses
import math
from types import SimpleNamespace
from typing import Any

import pytest

from commission.app.base.actions import Undo
from commission.app.base.server import start_server
from commission.app.base.state import AppState
from commission.app.base.view import view_of
from commission.app.run.actions import SetDisturbance, VirtualDrive
from commission.app.run.drives import prepare
from commission.app.run.world_panel import WorldPanel
from commission.errors import UsageError
from commission.progress import silent
from commission.site.disturbances import ConstantErrors, Disturbances, WheelNoise
from commission.site.intensity import IntensityModel
from commission.site.project import Project
from tests.app.asking import after, joined, taking

DEGREES = 180.0 / math.pi
FIELDS = {
    "walking_speed": ("Walking speed [m/s]", 1.0),
    "glints_per_scan": ("Glints per scan", 1.0),
    "dropped_scans": ("Scans lost [%]", 100.0),
    "slips_per_100_m": ("Wheel slips per 100 m", 1.0),
    "wheels.forward_per_sqrt_m": ("Along [mm/√m]", 1000.0),
    "wheels.lateral_per_sqrt_m": ("Across [mm/√m]", 1000.0),
    "wheels.heading_per_sqrt_m": ("Heading [°/√m]", DEGREES),
    "wheels.heading_per_sqrt_rad": ("Turning [°/√rad]", DEGREES),
    "wheels.forward_per_sqrt_s": ("Along, in time [mm/√s]", 1000.0),
    "wheels.heading_per_sqrt_s": ("Heading, in time [°/√s]", DEGREES),
    "intensity.reference_distance": ("Intensities at [m]", 1.0),
    "intensity.range_exponent": ("Falls by power", 1.0),
    "intensity.near_distance": ("Near field to [m]", 1.0),
    "intensity.reflector": ("Of reflectors", 1.0),
    "intensity.reflector_exponent": ("Tape falls by power", 1.0),
    "intensity.wall": ("Of walls", 1.0),
    "intensity.people": ("Of people", 1.0),
    "intensity.shiny": ("Of shiny objects", 1.0),
    "intensity.shiny_lobe": ("Mirror's 1σ [°]", DEGREES),
    "intensity.noise": ("Intensity 1σ [%]", 100.0),
    "intensity.echo_length": ("Echoes mix over [m]", 1.0),
    "intensity.crosstalk": ("Overflow [%]", 100.0),
    "intensity.crosstalk_width": ("Overflows by [°]", DEGREES),
    "intensity.response": ("Reported by power", 1.0),
    "intensity.largest": ("Saturates at", 1.0),
    "constants.survey_factor": ("Survey", 1.0),
    "constants.survey_sigma": ("Survey 1σ [mm]", 1000.0),
    "constants.mounting_sigma[0]": ("Mounting x 1σ [mm]", 1000.0),
    "constants.mounting_sigma[1]": ("Mounting y 1σ [mm]", 1000.0),
    "constants.mounting_sigma[2]": ("Facing 1σ [°]", DEGREES),
    "constants.range_bias_sigma": ("Range bias 1σ [mm]", 1000.0),
    "constants.clock_offset_sigma": ("Clock 1σ [ms]", 1000.0),
    "constants.forward_scale_sigma": ("All wheels 1σ [%]", 100.0),
    "constants.wheel_scale_sigma": ("Each wheel 1σ [%]", 100.0),
    "constants.separation_scale_sigma": ("Separation 1σ [%]", 100.0),
}
"""Label and factor of the unit of each number's widget."""
IN_FILE = {"shiny_objects", "tilted_stretches", "covered", "reels", "constants.scanners"}
"""Lists, which the page does not edit."""
GROUPS = {"wheels", "constants", "intensity"}
"""Values in folders of their own."""
SWITCHES = {"intensity.enabled"}
"""What is on or off."""


def test_every_number_of_the_virtual_world_has_one_widget_that_sets_it_in_its_unit(project: Project) -> None:
    names = {field.name for field in dataclasses.fields(Disturbances)} - GROUPS - IN_FILE - {"people"}
    names |= {f"wheels.{field.name}" for field in dataclasses.fields(WheelNoise)}
    names |= {f"constants.{field.name}" for field in dataclasses.fields(ConstantErrors)} - IN_FILE
    names |= {f"intensity.{field.name}" for field in dataclasses.fields(IntensityModel)} - SWITCHES
    assert {name.partition("[")[0] for name in FIELDS} == names
    state, posted, server = joined(AppState(project=project, saved=project)), [], start_server("127.0.0.1", 0)
    try:
        panel = WorldPanel(server.gui, taking(posted), state)
        widgets = [each for each in server.gui._gui_input_handle_from_uuid.values() if getattr(each, "label", "")]
        widgets = [each for each in widgets if "(disturbances." in (getattr(each, "hint", None) or "")]
        assert len(widgets) == len(FIELDS) + len(SWITCHES)
        for name, (label, factor) in FIELDS.items():
            (widget,) = [each for each in widgets if f"(disturbances.{name})" in each.hint]
            assert widget.label == label
            typed = float(widget.value) + 2.0
            before, widget._impl.value = widget._impl.value, typed
            for callback in list(widget._impl.update_cb):
                callback(SimpleNamespace(client=SimpleNamespace(client_id=1), client_id=1, target=widget))
            (action,) = posted
            posted.clear()
            assert action.name == name
            assert action.value == pytest.approx(typed / factor, rel=1e-9)
            widget._impl.value = before
            panel.draw_slowly(view_of(after(state, action).state))
            # Six digits.
            assert widget.value == pytest.approx(typed, rel=5.1e-6)
    finally:
        server.stop()


def test_an_edit_of_the_virtual_world_is_one_step_that_is_undone_and_tunes_nothing(project: Project) -> None:
    state = joined(AppState(project=project, saved=project))
    for name, value in (
        ("wheels.lateral_per_sqrt_m", 0.05),
        ("constants.mounting_sigma[2]", 0.01),
        ("intensity.enabled", True),
    ):
        changed = after(state, SetDisturbance(name, value)).state
        assert changed.project.disturbances != project.disturbances
        assert changed.project.parameters is project.parameters
        assert after(changed, Undo()).state.project == project
        assert after(changed, SetDisturbance(name, value)).state is changed


def test_what_is_no_disturbance_or_out_of_bounds_is_refused(project: Project) -> None:
    state: Any = joined(AppState(project=project, saved=project))
    with pytest.raises(UsageError, match=r"no disturbance is called 'wheels.up'; expected one of: wheels.forward"):
        after(state, SetDisturbance("wheels.up", 1.0))
    with pytest.raises(ValueError, match=r"wheels.lateral_per_sqrt_m is -1; expected 0"):
        after(state, SetDisturbance("wheels.lateral_per_sqrt_m", -1.0))


def test_the_next_drive_is_that_of_the_world_as_it_is_now(project: Project) -> None:
    state = joined(AppState(project=project, saved=project))
    noisy = after(state, SetDisturbance("wheels.lateral_per_sqrt_m", 0.05)).state.project
    source = VirtualDrive(project.routes[0].name, seed=1)
    one, other = (prepare(each, source, silent).log for each in (project, noisy))
    assert (one.displacements != other.displacements).any()
    assert other.truth is not None
    assert other.truth.wheels.noise.lateral_per_sqrt_m == 0.05
