"""Refusals of scanner and vehicle in the page's own words and units: files call fields by keys, people by labels."""

from __future__ import annotations

import re

from commission.site.fields import described
from commission.site.scanner import Scanner
from commission.site.vehicle import DifferentialVehicle, OmnidirectionalVehicle, TricycleVehicle

KINDS_OF_EQUIPMENT = (Scanner, DifferentialVehicle, TricycleVehicle, OmnidirectionalVehicle)
PARTS = {
    "outline": ("corner", ("x", "y"), " m"),
    "blind_sectors_deg": ("sector", ("first bearing", "last bearing"), "°"),
    "detection_rates": ("pair", ("distance", "share"), ""),
}
"""Of lists of pairs: what one of them is called, what its two numbers are, and their unit behind a number."""
OF_TWO = {"field_of_view_deg": ("First and last bearing", "°"), "range": ("Smallest and largest range", " m")}
"""Fields of two numbers, each of which has its own widget."""
NUMBER = r"-?[\w.+-]+"


def in_words_of_the_page(text: str) -> str:
    """Return a refusal with fields called as their widgets are, their numbers counted from 1 and in the page's units.

    Parameters
    ----------
    text : `scanner.blind_sectors_deg[0][1] is 400; expected -360 to 360 deg`.
    """
    labels = {name: tuple(one.label for one in each) for kind in KINDS_OF_EQUIPMENT for name, each in described(kind)}

    def called(found: re.Match[str]) -> str:
        name, index, which, value = found.groups()
        if name not in labels:
            return found[0]
        if name in PARTS and which is not None:
            part, two, unit = PARTS[name]
            return f"{labels[name][0]}: {two[int(which)]} of {part} {int(index) + 1}{value}{unit}"
        if index is None or len(labels[name]) > 1:
            return labels[name][int(index or 0)]
        return f"{labels[name][0]}: number {int(index) + 1}"

    for name, (both, unit) in OF_TWO.items():
        text = re.sub(
            rf"\b(?:scanner|vehicle)\.{name} is \[({NUMBER}), ({NUMBER})\]", rf"{both} are \1 and \2{unit}", text
        )
    text = re.sub(rf"\b(?:scanner|vehicle)\.(\w+)(?:\[(\d+)\])?(?:\[(\d)\]( is {NUMBER}))?", called, text)
    text = re.sub(rf"(?<=Blind sectors )holds \[({NUMBER}), ({NUMBER})\]", r"have \1 to \2°", text)
    text = re.sub(rf"\[({NUMBER}), ({NUMBER})\]", r"\1 to \2°" if "Blind" in text else r"\1 \2", text)
    return text.replace(" deg", "°")
