"""The pages of the documentation as tests read them: YAML blocks, words in backticks, and the schema they must fit."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from fsci.schema import json_schema

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted(ROOT.glob("docs/*.md"))]
SCHEMA = json.loads(json_schema())
MODELS = SCHEMA["$defs"]


def yaml_blocks(page: Path) -> list[str]:
    """The texts of a page's YAML blocks."""
    return re.findall(r"^```yaml\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL)


def is_case(block: str) -> bool:
    """Whether a block is a whole case: it has a title. Others are parts of cases."""
    return block.startswith("title:") or "\ntitle:" in block


def in_backticks(page: Path) -> list[str]:
    """What a page has in single backticks outside of blocks."""
    text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
    return re.findall(r"(?<!`)`([^`\n]+)`(?!`)", text)


def parsed(text: str) -> Any:
    """The YAML value of a text; None if it is not YAML."""
    try:
        return YAML(typ="safe", pure=True).load(text)
    except YAMLError:
        return None


def options(schema: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """What a setting can be: references followed, alternatives apart."""
    if "$ref" in schema:
        yield from options(MODELS[schema["$ref"].rsplit("/", 1)[1]])
    elif alternatives := [*schema.get("anyOf", []), *schema.get("oneOf", [])]:
        for one in alternatives:
            yield from options(one)
    else:
        yield schema


def fits(value: Any, schema: dict[str, Any]) -> bool:
    """Whether all keys of a YAML value are settings of the schema, and its words are among the allowed ones."""
    return any(_fits(value, one) for one in options(schema))


def _fits(value: Any, schema: dict[str, Any]) -> bool:
    if isinstance(value, dict):
        known, others = schema.get("properties", {}), schema.get("additionalProperties")
        if isinstance(others, dict):
            return all(fits(one, others) for one in value.values())
        return all(key in known and fits(one, known[key]) for key, one in value.items())
    if isinstance(value, list):
        return "items" in schema and all(fits(one, schema["items"]) for one in value)
    words = schema.get("enum", [schema["const"]] if "const" in schema else None)
    return "properties" not in schema and (words is None or value in words)


def fits_somewhere(value: dict[str, Any]) -> bool:
    """Whether a part of a case fits the case or any of its sections."""
    return any(fits(value, one) for one in (SCHEMA, *MODELS.values()))


def has_setting(path: list[str], schema: dict[str, Any]) -> bool:
    """Whether dotted names lead to a setting; names of bodies, patches and the like may be any."""
    if not path:
        return True
    for one in options(schema):
        known, others = one.get("properties", {}), one.get("additionalProperties")
        if path[0] in known and has_setting(path[1:], known[path[0]]):
            return True
        if isinstance(others, dict) and has_setting(path[1:], others):
            return True
        if "items" in one and path[0].isdigit() and has_setting(path[1:], one["items"]):
            return True
    return False
