"""The generated descriptions of the case format are complete."""

import json
import re
from pathlib import Path

from ruamel.yaml import YAML

from fsci.case.mesh import SHAPES
from fsci.case.section import Section
from fsci.schema import json_schema, reference_markdown
from fsci.schema_examples import EXAMPLES


def properties(schema):
    """(model, setting, its schema) of the whole format."""
    for name, model in {"Case": schema, **schema["$defs"]}.items():
        for key, value in model["properties"].items():
            yield name, key, value


def test_every_setting_has_a_meaning():
    schema = json.loads(json_schema())
    assert [f"{name}.{key}" for name, key, value in properties(schema) if not value.get("description")] == []
    assert [name for name, model in schema["$defs"].items() if not model.get("description")] == []


def test_the_reference_has_every_setting_in_the_chapter_of_its_section():
    chapters = {part.split(")=")[0]: part for part in reference_markdown().split("\n(input-")[1:]}
    for name, key, value in properties(json.loads(json_schema())):
        rows = [row for row in chapters[name.lower()].split("\n") if row.startswith(f"| `{key}` |")]
        assert len(rows) == 1
        assert len(rows[0].replace("\\|", "").split("|")) == 7
        assert value["description"].split("|")[0] in rows[0]


def test_lines_of_the_reference():
    lines = reference_markdown().split("\n")
    assert "| `step` | number > 0 | required | s | time step |" in lines
    assert "| `start` | number | `0.0` | s | first time |" in lines
    assert "| `gravity` | list (2 or 3, expression of x, y, z, t) |  | m/s^2 | acceleration of gravity |" in lines
    assert "| `lambda` | expression of x, y, z |  | Pa | first Lame constant |" in lines
    assert (
        "| `halvings` | whole number >= 0 | `8` |  | how many times a step may be halved before the run ends |" in lines
    )
    assert "## `structure.bodies.NAME.mesh` with shape: `tube` or `annulus`" in lines


def test_the_reference_in_the_repository_is_that_of_the_settings():
    """`make docs` writes it."""
    written = (Path(__file__).parents[2] / "docs" / "reference" / "case.md").read_text()
    assert written == reference_markdown() + "\n"


def test_links_of_the_reference_lead_somewhere():
    text = reference_markdown()
    for part in text.split("](#")[1:]:
        assert f"\n({part.split(')')[0]})=\n" in text


def test_json_schema():
    schema = json.loads(json_schema())
    assert schema["$id"] == "urn:fsci:case"
    assert schema["else"]["required"] == ["time"]
    assert schema["additionalProperties"] is False
    step = schema["$defs"]["Time"]["properties"]["step"]
    assert (step["type"], step["exclusiveMinimum"]) == (["number", "string"], 0)
    cells = schema["$defs"]["Box"]["properties"]["cells"]
    assert (cells["minItems"], cells["maxItems"]) == (3, 3)
    assert {"lambda", "E"} <= schema["$defs"]["Elastic"]["properties"].keys()
    shapes = schema["$defs"]["Body"]["properties"]["mesh"]["oneOf"][1]["discriminator"]["mapping"]
    assert sorted(shapes) == sorted(SHAPES)
    assert {"const": "none"} in schema["properties"]["contact"]["anyOf"]


def sections(base=Section):
    """Name -> class of all sections, at any depth below `base`."""
    found = {}
    for one in base.__subclasses__():
        found |= {one.__name__.removesuffix("Section"): one, **sections(one)}
    return found


def test_every_section_has_an_example_that_it_accepts():
    schema = json.loads(json_schema())
    assert EXAMPLES.keys() == {"Case", *schema["$defs"]}
    titles = dict(re.findall(r"^\(input-(\w+)\)=\n## (.*)$", reference_markdown(), re.MULTILINE))
    for name, text in EXAMPLES.items():
        value = YAML(typ="safe", pure=True).load(text)
        title = titles[name.lower()].split("` with ")[0].strip("`")
        if name != "Case":
            (key,) = value
            assert key in title, "the setting that holds the section"
            value = value[key]
        found = value.values() if title.endswith(".NAME") else value if isinstance(value, list) else [value]
        for one in found:
            sections()[name].model_validate(one, strict=False)
