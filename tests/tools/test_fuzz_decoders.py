"""The fuzzing of decoders finds what it shall: telegrams that are decoded, and others that are refused."""

from __future__ import annotations

import pytest

from tests.tools.fuzz_decoders import SEEDS, fuzz


@pytest.mark.parametrize("name", SEEDS)
def test_sound_telegram_of_each_kind_is_decoded(name: str) -> None:
    sound, decode = SEEDS[name]

    decode(sound)


def test_changed_telegrams_are_decoded_or_refused_and_both_happen() -> None:
    told = fuzz(8_000, 3)

    assert {f"{name}: {fate}" for name in SEEDS for fate in ("decoded", "refused")} - {"CoLa frames: refused"} <= set(
        told
    )
    assert not any("slower" in line for line in told)
