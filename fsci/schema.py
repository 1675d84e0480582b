"""The case format described from its models: JSON schema for editors, and the input reference in Markdown."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

from fsci.case import Case
from fsci.expression import FUNCTIONS
from fsci.schema_examples import EXAMPLES

INTRODUCTION = """\
# Input reference

A case is a YAML 1.2 file. This page is generated from the program: every setting with its type, default, unit and
meaning, and an example of each section. Units are those of SI; with `units:` they are the corresponding ones of
length, mass and time.

- A *number* may be written as arithmetic: `2*pi/360`.
- An *expression* may contain variables too, x, y, z being reference coordinates and t the time. There are the operators
  `+ - * / ** ^`, comparisons, `and`, `or`, `not`, the constants `pi` and `e`, and the functions {functions}.
  `where(condition, a, b)` is a where the condition holds, else b; `ramp(t, a, b)` rises from 0 at a to 1 at b, its
  first two derivatives being zero at both ends. The functions of the section `curves` belong to them. YAML needs quotes
  around an expression that begins with `*`, or has a comma within brackets: `[0, "min(t, 1)"]`.
- A *name* has letters, digits, `_` and `-`.
- `include: FILE` in a section stands for the settings in another YAML file, or for its list. Settings beside it win.
  Names of files in either file count from the folder of the file that is the case.
- `<<: *other` takes over the settings of a section marked `&other`.
"""

#: settings of every mesh, listed after its own
COMMON = ("order", "cell", "surfaces", "mirror", "rotate", "translate")


#: By which editors and other schemas name that of case files, whichever file it is in.
IDENTIFIER = "urn:fsci:case"


def json_schema() -> str:
    """JSON schema of the case format."""
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": IDENTIFIER, "title": "Case of fsci"}
    return json.dumps({**_with_include(_schema()), **head}, indent=2)


def _schema() -> dict[str, Any]:
    """The schema of all models; the name of a section is that of its model without `Section`."""
    return json.loads(re.sub(r"(\w)Section\b", r"\1", json.dumps(Case.model_json_schema())))


#: Of a section, and of the section in place of a list of sections.
FILE_OF_PART = {"^include$": {"type": "string", "description": "a file with these settings, or with the list"}}


def _with_include(schema: dict[str, Any]) -> dict[str, Any]:
    """The schema in which sections, and lists of them, may be in a file; then it has the required settings."""
    found = dict(schema)
    for key in ("$defs", "properties"):
        if key in schema:
            found[key] = {name: _with_include(one) for name, one in schema[key].items()}
    for key in ("anyOf", "oneOf"):
        if key in schema:
            found[key] = [_with_include(one) for one in schema[key]]
    for key in ("items", "additionalProperties"):
        if isinstance(schema.get(key), dict):
            found[key] = _with_include(schema[key])
    if schema.get("type") == "object":
        found["patternProperties"] = FILE_OF_PART
        if required := found.pop("required", None):
            found |= {"if": {"required": ["include"]}, "else": {"required": required}}
    elif schema.get("type") == "array" and _references(schema):
        found |= {"type": ["array", "object"], "patternProperties": FILE_OF_PART, "required": ["include"]}
        found["additionalProperties"] = False
    return found


def reference_markdown() -> str:
    """The input reference: one chapter for each section."""
    schema = _schema()
    models = schema.pop("$defs")
    functions = ", ".join(f"`{name}`" for name in FUNCTIONS)
    chapters = [INTRODUCTION.replace("{functions}", functions), _chapter("case.yaml", "Case", schema, models)]
    written: set[str] = set()
    for title, name in _sections("", schema, models):
        if name not in written:
            written.add(name)
            chapters.append(_chapter(title, name, models[name], models))
    return "\n".join(chapters)


def _sections(path: str, model: dict[str, Any], models: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Path and model name of every section below this one, depth first."""
    for key, schema in model["properties"].items():
        for suffix, name in _references(schema):
            title = f"{path}{key}{suffix}"
            alternatives = models[name]["properties"]
            kinds = [f"{k}: {_type(alternatives[k])}" for k in ("shape", "law") if k in alternatives]
            yield f"`{title}`" + "".join(f" with {kind}" for kind in kinds), name
            yield from _sections(f"{title}.", models[name], models)


def _references(schema: dict[str, Any]) -> list[tuple[str, str]]:
    """The models that a setting may have, each with the path between: .NAME for a mapping, [..] for a list."""
    if "$ref" in schema:
        return [("", schema["$ref"].rsplit("/", 1)[1])]
    found: dict[str, str] = {}
    for suffix, inner in (
        *(("", option) for option in (*schema.get("anyOf", []), *schema.get("oneOf", []))),
        *((".NAME", schema[k]) for k in ("additionalProperties",) if isinstance(schema.get(k), dict)),
        *(("[..]", schema[k]) for k in ("items",) if k in schema),
    ):
        for more, name in _references(inner):
            found.setdefault(name, suffix + more)
    return [(suffix, name) for name, suffix in found.items()]


def _chapter(title: str, name: str, model: dict[str, Any], models: dict[str, Any]) -> str:
    required = model.get("required", [])
    names = sorted(model["properties"], key=lambda key: (key not in required, key in COMMON))
    rows = [
        f"| `{key}` | {_type(schema)} | {_default(key, schema, required)} | {schema.get('unit', '')} "
        f"| {schema.get('description', '').replace('|', chr(92) + '|')} |"
        for key in names
        for schema in [model["properties"][key]]
    ]
    head = ["| setting | type | default | unit | meaning |", "|---|---|---|---|---|"]
    example = ["```yaml", EXAMPLES[name].rstrip("\n"), "```"]
    lines = [f"(input-{name.lower()})=", f"## {title}", "", model["description"], "", *head, *rows, "", *example, ""]
    return "\n".join(lines)


def _type(schema: dict[str, Any]) -> str:
    """The type of a setting in words."""
    if "$comment" in schema:
        return str(schema["$comment"])
    if "$ref" in schema:
        name = schema["$ref"].rsplit("/", 1)[1]
        return f"[{name}](#input-{name.lower()})"
    if "const" in schema or "enum" in schema:
        return " or ".join(f"`{word}`" for word in schema.get("enum", [schema.get("const")]))
    if options := [*schema.get("anyOf", []), *schema.get("oneOf", [])]:
        words = [_type(option) for option in options if option.get("type") != "null"]
        return " or ".join(dict.fromkeys(words))
    if schema["type"] == "array":
        items = schema["items"]
        free = " or null" if {"type": "null"} in items.get("anyOf", []) else ""
        fewest, most = schema.get("minItems"), schema.get("maxItems")
        count = "" if fewest is None or most is None else f"{fewest}, " if fewest == most else f"{fewest} or {most}, "
        return f"list ({count}{_type(items)}{free})"
    if schema["type"] == "object":
        return f"NAME: {_type(schema['additionalProperties'])}"
    return {"string": "text", "boolean": "true or false"}[schema["type"]]


def _default(key: str, schema: dict[str, Any], required: list[str]) -> str:
    if key in required:
        return "required"
    if "default" in schema:
        value = schema["default"]
        return "" if value in (None, "") else f"`{json.dumps(value)}`".replace('"', "")
    return "" if "$ref" in schema else "none"
