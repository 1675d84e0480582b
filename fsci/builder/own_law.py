"""Laws of materials from functions in Python files of the user, whose code runs only where the user trusts it."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from inspect import Parameter, signature
from typing import Any

import numpy as np

from fsci.case import Case, CaseError
from fsci.case.errors import did_you_mean
from fsci.case.material import OwnLawSection
from fsci.case.plain_file import Unreadable, read_file
from fsci.case.values import value_of
from solvers.api import Array
from solvers.structure.materials import Material
from solvers.structure.materials.own_energy import SmallStrains, at_small_strains, law_of_energy
from solvers.values import evaluate

#: Largest size of a file with code [bytes].
LARGEST_CODE = 10**6


def own_law(case: Case, body: str) -> Material:
    """The law of a body from its file. Raises CaseError."""
    settings = _settings(case, body)
    density = 0.0 if settings.density is None else value_of(settings.density)
    return law_of_energy(_energy(case, body), settings.values, density)


def own_law_at_rest(case: Case, body: str, points: Array) -> SmallStrains:
    """Of the law of a body, for the means of its parameters over points, shape (3, n) or (2, n). Raises CaseError."""
    settings, energy = _settings(case, body), _energy(case, body)
    values = {name: float(np.mean(evaluate(value, points, 0.0))) for name, value in settings.values.items()}
    try:
        found = at_small_strains(energy, values)
    except Exception as error:
        raise _mistake(case, body, f"the energy of '{settings.function}' {_told(error, settings.file)}") from None
    for word, modulus in (("shear", found.mu), ("bulk", found.bulk)):
        if not modulus > 0.0:
            of = f"the {word} modulus of '{settings.function}' at small strains"
            raise _mistake(case, body, f"{of} must be greater than 0, not {modulus:.4g}")
    return found


def _energy(case: Case, body: str) -> Callable[..., Any]:
    """The function in its file, which takes F and the parameters of the case. Raises CaseError."""
    settings = _settings(case, body)
    if not case.trusted:
        words = f"runs the code of '{settings.file}': give the option '--trust' if you know what it does"
        raise _mistake(case, body, words)
    found: dict[str, Any] = {"__name__": "own_law"}
    try:
        code = read_file(case.folder / settings.file, LARGEST_CODE)
        exec(compile(code, settings.file, "exec"), found)
    except Unreadable as error:
        raise _mistake(case, body, f"the file '{settings.file}' {error}") from None
    except Exception as error:
        raise _mistake(case, body, f"the code of '{settings.file}' {_told(error, settings.file)}") from None
    function = found.get(settings.function)
    if not callable(function):
        functions = [name for name, value in found.items() if callable(value) and not name.startswith("_")]
        hint = did_you_mean(settings.function, functions)
        raise _mistake(case, body, f"'{settings.file}' has no function '{settings.function}'{hint}")
    _require_parameters(case, body, function)
    return function  # type: ignore[no-any-return]


def _require_parameters(case: Case, body: str, function: Callable[..., Any]) -> None:
    settings = _settings(case, body)
    _, *named = signature(function).parameters.values() or [None]
    names = [parameter.name for parameter in named if parameter is not None]
    for name in settings.parameters:
        if name not in names:
            words = f"'{settings.function}' has no parameter '{name}'{did_you_mean(name, names)}"
            raise case.error((*_keys(body), "parameters", name), words)
    needed = [one.name for one in named if one is not None and one.default is Parameter.empty]
    if missing := [name for name in needed if name not in settings.parameters]:
        raise _mistake(case, body, f"'{settings.function}' needs the parameter '{missing[0]}' in 'parameters'")


def _told(error: Exception, file: str) -> str:
    """What went wrong, with the line of the file."""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
    line = error.lineno if isinstance(error, SyntaxError) else (lines or [None])[-1]
    at = f" in line {line}" if line else ""
    return f"fails{at}: {type(error).__name__}: {error.msg if isinstance(error, SyntaxError) else error}"


def _settings(case: Case, body: str) -> OwnLawSection:
    settings = case.elastic_bodies[body].material
    assert isinstance(settings, OwnLawSection)
    return settings


def _keys(body: str) -> tuple[str, ...]:
    return "structure", "bodies", body, "material"


def _mistake(case: Case, body: str, words: str) -> CaseError:
    return case.error((*_keys(body), "law"), words)
