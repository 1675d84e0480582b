"""From a file to a case that can be run."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from pydantic import ValidationError

from fsci.case.case import Case
from fsci.case.checks import mistakes
from fsci.case.curve import functions
from fsci.case.document import override, read_document
from fsci.case.errors import CaseError
from fsci.case.expressions import value_mistakes
from fsci.case.messages import problems
from fsci.case.plausible import warnings
from fsci.case.probe_checks import field_of

#: Variable of the environment by which programs that a command starts have its `--trust`.
TRUST = "FSCI_TRUST"


def load_case(path: str | Path, overrides: Iterable[tuple[str, str]] = (), *, trust: bool = False) -> Case:
    """Read, override and validate a case; raises CaseError with all problems found.

    `path` is the file, or the folder with its case.yaml; `overrides` are dotted names and values as YAML text; with
    `trust` code of files that the case names may run.
    """
    path = Path(path)
    document = read_document(path / "case.yaml" if path.is_dir() else path)
    for dotted, text in overrides:
        document = override(document, dotted, text)
    data, folder = document.data, document.path.parent
    curves = functions(data.get("curves"), folder) if isinstance(data, dict) else {}
    try:
        case = Case.model_validate(data, context={"functions": curves, "folder": folder})
    except ValidationError as error:
        raise CaseError(problems(error, document)) from None
    case._document = document
    case._trusted = trust or os.environ.get(TRUST) == "1"
    wrong = list(mistakes(case)) or value_mistakes(case)
    found = [document.problem(document.place(keys), message) for keys, message in wrong]
    if found:
        raise CaseError(found)
    case._warnings = tuple(f"{document.place(keys)}: {message}" for keys, message in warnings(case))
    return _with_defaults(case)


def _with_defaults(case: Case) -> Case:
    """Probes learn which field they measure, and the body if the field has only one."""
    probes = {}
    for name, probe in case.probes.items():
        field = field_of(case, probe)
        section = case.structure if field == "structure" else case.fluid
        bodies = list(section.bodies) if section is not None else []
        update: dict[str, str] = {"field": field or ""}
        if probe.body is None and len(bodies) == 1 and field == "structure":
            update["body"] = bodies[0]
        probes[name] = probe.model_copy(update=update)
    return case.model_copy(update={"probes": probes})
