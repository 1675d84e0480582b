"""Contact pairs that `probes` and `verify` name, against those of the run: with those that the program finds."""

from __future__ import annotations

from collections.abc import Iterator

from fsci.builder.closed_parts import closed_parts
from fsci.case import Case, CaseError
from fsci.case.errors import did_you_mean
from fsci.case.mesh_checks import Mistake
from fsci.case.probe_checks import known_columns, possible_walls


def require_known_pairs(case: Case) -> None:
    """case: with all its pairs named (`with_pairs`). Raises CaseError with all names that no pair of the run has."""
    if wrong := [problem for keys, message in _mistakes(case) for problem in case.error(keys, message).problems]:
        raise CaseError(wrong)


def _mistakes(case: Case) -> Iterator[Mistake]:
    walls = [] if case.contact_off or case.coupling is None else [wall.name for wall in closed_parts(case)]
    pairs = [*([] if case.contact is None else case.contact.pairs)]
    pairs += [f"{body}_{wall}" for body in case.elastic_bodies for wall in walls]
    for name, probe in case.probes.items():
        if probe.pair is not None and probe.pair not in pairs:
            yield ("probes", name, "pair"), f"unknown pair '{probe.pair}'{did_you_mean(probe.pair, pairs)}"
    none = {f"contact.{name}" for name in possible_walls(case) if name not in pairs}  # open faces
    columns = [column for column in known_columns(case) if column.rpartition(".")[0] not in none]
    for i, check in enumerate(case.verify):
        if check.value.startswith("contact.") and check.value not in columns:
            yield ("verify", i, "value"), f"there is no value '{check.value}'{did_you_mean(check.value, columns)}"
