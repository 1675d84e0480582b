"""Errors of pydantic as located problems in plain words."""

from __future__ import annotations

import re
from typing import Any

from pydantic import ValidationError

from fsci.case.document import Document
from fsci.case.errors import Problem, did_you_mean, listed
from fsci.case.values import describe_value
from fsci.case.yaml_text import Keys

EMPTY = "is empty: give it a value"


def problems(error: ValidationError, document: Document) -> list[Problem]:
    """A problem with position and message for each error."""
    return [_problem(dict(item), document) for item in error.errors(include_url=False)]


def _problem(item: dict[str, Any], document: Document) -> Problem:
    keys = _keys(item["loc"], document.data, absent=item["type"] == "missing")
    context = item.get("ctx", {})
    match item["type"]:
        case "missing":
            *above, name = keys
            inside = f" in {subject(tuple(above))}" if above else ""
            return document.problem(document.key_place(tuple(above)), f"missing setting '{name}'{inside}")
        case "extra_forbidden":
            return document.problem(document.key_place(keys), _unknown(keys, item["input"].names))
        case "fault":
            keys = (*keys, *context["keys"])
            empty = item["input"] is None and context["message"].startswith("must ")
            message = _with_subject(EMPTY if empty else context["message"], keys)
            if item["loc"] and item["loc"][-1] == "[key]":
                return document.problem(document.key_place(keys), message)
            column = context["column"]
            return document.problem(document.text_place(keys, column) if column else document.place(keys), message)
    message = f"{subject(keys)} {_wanted(item)}" if keys else _root(item["input"])
    return document.problem(document.place(keys), message)


def _wanted(item: dict[str, Any]) -> str:
    """The message that a value violates a condition, with the value."""
    value = item["input"]
    if value is None:
        return EMPTY
    match item["type"]:
        case "model_type" | "model_attributes_type":
            return f"must be a section of settings, not {describe_value(value)}"
        case "dict_type":
            return f"must be a section of names, not {describe_value(value)}"
        case "tuple_type" | "list_type":
            hint = ": begin each entry with '- '" if isinstance(value, dict) else ""
            return f"must be a list, not {describe_value(value)}{hint}"
        case "literal_error":
            expected = item["ctx"]["expected"]
            if names := re.findall(r"'([^']*)'", expected):
                hint = did_you_mean(value, names) if isinstance(value, str) else ""
                return f"must be {listed(names)}, not {describe_value(value)}" + (hint if hint.startswith(";") else "")
            return f"must be {expected}, not {describe_value(value)}"
    return f"cannot be {describe_value(value)}"


def _root(value: Any) -> str:
    if value is None:
        return "the case is empty"
    return f"the case must be a section of settings such as 'time:' and 'structure:', not {describe_value(value)}"


def _unknown(keys: Keys, names: list[str]) -> str:
    name = str(keys[-1])
    return f"unknown setting '{name}'{did_you_mean(name, names)}"


def _with_subject(message: str, keys: Keys) -> str:
    if message.startswith(":"):
        return subject(keys) + message
    return f"{subject(keys)} {message}" if message.startswith(("must ", "needs ", "is ")) else message


def subject(keys: Keys) -> str:
    """The name of a setting in messages: its key, or its number (from 1) in a list."""
    if not keys:
        return "the case"
    if isinstance(keys[-1], int):
        return f"entry {keys[-1] + 1} of {subject(keys[:-1])}"
    return f"'{keys[-1]}'"


def _keys(loc: tuple[str | int, ...], data: Any, *, absent: bool) -> Keys:
    """The path of the setting that pydantic means: without the names it inserts for alternatives and wrapped values.

    Only the last step may be `absent` from the data.
    """
    keys: list[str | int] = []
    for count, step in enumerate(loc):
        if isinstance(data, dict) and step in data:
            data = data[step]
        elif isinstance(data, list) and isinstance(step, int) and step < len(data):
            data = data[step]
        elif not absent or count < len(loc) - 1:
            continue
        keys.append(step)
    return tuple(keys)
