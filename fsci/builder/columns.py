"""The probes of a case as columns of the history; the builders of the fields have tables of how they are made."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeAlias, TypeVar

from fsci.case import Case
from fsci.case.quantities import Field

T = TypeVar("T")

#: Column of the history, or its part behind the name of the probe -> value.
Numbers = dict[str, float]
#: (quantity, setting of the location) -> how a probe of a field is made, from the case, the field and the probe's name.
Table: TypeAlias = Mapping[tuple[str, str], Callable[[Case, T, str], Callable[[], Numbers]]]


def build_probes(case: Case, of: Field, table: Table[T], field: T) -> Callable[[], Numbers]:
    """All probes of a field as one function: NAME, or NAME.x for each component of a vector.

    Raises CaseError (collective).
    """
    chosen = [(name, probe) for name, probe in case.probes.items() if probe.field == of]
    probes = {name: table[probe.quantity, probe.place](case, field, name) for name, probe in chosen}
    return lambda: {
        f"{name}.{part}" if part else name: value for name, probe in probes.items() for part, value in probe().items()
    }


def joined(parts: list[Callable[[], Numbers]]) -> Callable[[], Numbers]:
    """The columns of several fields as one function."""
    return lambda: {column: value for measure in parts for column, value in measure().items()}
