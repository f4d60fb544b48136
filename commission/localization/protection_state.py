"""Filters of the protection level as a value, between two cycles: it knows whom each of them leaves out.

So it outlives a change of the map: a filter without a reflector that is no longer there is given up. Steps:
`protection`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from commission.geometry.arrays import FloatArray, IntArray, read_only
from commission.localization.protection import Bank, ProtectionModel, new_bank
from commission.localization.reflector_index import ReflectorIndex, in_order_of_map
from commission.site.parameters import HELD_LEVEL, Parameters
from commission.site.reflectors import Reflector


@dataclass(frozen=True, slots=True, eq=False)
class ProtectionState:
    """A bank that has begun."""

    names: tuple[str, ...]
    """Ids of the reflectors of the map, by the numbers of `owner`."""
    beliefs: FloatArray
    """(SLOTS + 2, 9) see `Bank`; read-only."""
    owner: IntArray
    """(SLOTS,) index in `names` of the reflector that each leaves out; -1: not used."""
    unseen: IntArray
    """(SLOTS,) cycles since its last sighting."""

    def __eq__(self, other: object) -> bool:
        """Whether both say the same, to the last bit."""
        if not isinstance(other, ProtectionState):
            return NotImplemented
        return self._bits() == other._bits()

    def __hash__(self) -> int:
        """Equal ones have the same."""
        return hash(self._bits())

    def _bits(self) -> tuple[object, ...]:
        return self.names, self.beliefs.tobytes(), self.owner.tobytes(), self.unseen.tobytes()


def protection_model(
    parameters: Parameters, index: ReflectorIndex, reflectors: tuple[Reflector, ...]
) -> ProtectionModel | None:
    """Return what levels are reckoned with; None where the supervisor does not go by them.

    Parameters
    ----------
    parameters : of every stage.
    index, reflectors : the map.
    """
    supervisor, given = parameters.supervisor, parameters.integrity
    if not supervisor.enabled or supervisor.held != HELD_LEVEL:
        return None
    numbers = read_only(np.arange(len(reflectors), dtype=np.int64))
    others = not parameters.temporary.enabled
    return ProtectionModel(given.risk, given.fault_probability, in_order_of_map(index), numbers, others)


def bank_of(state: ProtectionState | None, names: tuple[str, ...] | None) -> Bank | None:
    """Bank for the steps to write in: a copy, by the numbers of a map; None where no levels are asked for.

    Parameters
    ----------
    state : after the cycle before; None: none has begun.
    names : ids of the reflectors of the map; None: levels are not asked for.
    """
    if names is None:
        return None
    bank = new_bank()
    if state is None:
        return bank
    bank.beliefs[:], bank.unseen[:], bank.begun[0] = state.beliefs, state.unseen, True
    if state.names == names:
        bank.owner[:] = state.owner
        return bank
    here = {name: number for number, name in enumerate(names)}
    bank.owner[:] = [here.get(state.names[owner], -1) if owner >= 0 else -1 for owner in state.owner.tolist()]
    return bank


def protection_state(bank: Bank | None, names: tuple[str, ...] | None) -> ProtectionState | None:
    """Return what steps have left in a bank, as a value; None where no filter is in use.

    Parameters
    ----------
    bank : after the steps.
    names : as `bank_of` was given them.
    """
    if names is None or bank is None or not bank.begun[0]:
        return None
    return ProtectionState(
        names, read_only(bank.beliefs.copy()), read_only(bank.owner.copy()), read_only(bank.unseen.copy())
    )
