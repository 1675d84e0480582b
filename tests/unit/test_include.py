"""`include: FILE`: parts of a case in files of their own, with positions in them, and a case that is kept whole."""

import json
from pathlib import Path

import pytest
from case_mistakes import load, refused
from small_cases import PLATE

from fsci.case.document import read_document
from fsci.case.yaml_text import parse_yaml
from fsci.running.history import read_history
from fsci.running.run import FINISHED, resume_run, run_case
from fsci.schema import json_schema

#: PLATE in four files: a section with a setting beside `include`, a body, a list, and all of it.
MAIN = """\
include: parts/times.yaml
structure:   # solid
  include: parts/structure.yaml
"""
PARTS = {
    "times.yaml": "time: {step: 0.2, end: 1}\n",
    "structure.yaml": "bodies:   # bodies\n  plate:\n    include: plate.yaml\n    body_force: [0, '1e-6*t']\n",
    "plate.yaml": """\
mesh: {shape: rectangle, size: [1, 1], cells: [2, 2], order: 1}   # four cells
material: {law: neo_hooke, E: 1, nu: 0.3}
supports: {include: supports.yaml}
body_force: [1, 1]
""",
    "supports.yaml": "- {on: left, displacement: [0, 0]}\n",
}


@pytest.fixture(autouse=True)
def _parts(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("parts").mkdir()
    for name, text in PARTS.items():
        Path("parts", name).write_text(text)


def test_settings_are_those_of_one_file():
    assert load(MAIN).settings == parse_yaml(PLATE, "").data
    plate = load(MAIN, [("structure.bodies.plate.supports.0.on", "top")]).elastic_bodies["plate"]
    assert plate.supports[0].on == ("top",)


@pytest.mark.parametrize("changes", [[], [("structure.bodies.plate.mesh.cells", "[3, 2]"), ("title", "other")]])
def test_text_that_is_kept(changes):
    """It has all settings, and the comments of all files."""
    case = load(MAIN, changes)
    text = case.dump()
    assert parse_yaml(text, "").data == case.settings
    assert {"# solid", "# bodies", "# four cells"} <= {
        f"#{line.split('#')[1]}" for line in text.split("\n") if "#" in line
    }


def test_run_and_resume():
    """The history is that of the case in one file; it goes on when the parts are gone."""
    assert run_case(load(PLATE), Path("one")) == FINISHED
    assert run_case(load(MAIN, [("time.end", "0.6")]), Path("parted")) == FINISHED
    for name in PARTS:
        Path("parts", name).unlink()
    assert resume_run(Path("parted"), [("time.end", "1")]) == FINISHED
    one, parted = (read_history(Path(name, "history.csv")) for name in ("one", "parted"))
    assert parted["time"] == pytest.approx(one["time"], rel=1e-12)
    assert parted["structure.energy"] == pytest.approx(one["structure.energy"], rel=1e-8)


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        (
            "parts/plate.yaml", "nu: 0.3", "nu: 0.7",
            "parts/plate.yaml:2:38: 'nu' must be above -1 and below 0.5, not 0.7\n"
            "  material: {law: neo_hooke, E: 1, nu: 0.7}",
        ),
        ("parts/supports.yaml", "on: left", "on: lefd", "parts/supports.yaml:1:8: 'rectangle' has no surface 'lefd'"),
        ("parts/plate.yaml", "[2, 2], order: 1", "[2, 2", "parts/plate.yaml:1:47: this list needs ',' or ']'"),
        ("parts/times.yaml", "step: 0.2, ", "", "parts/times.yaml:1:1: missing setting 'step' in 'time'"),
        ("case.yaml", "times.yaml", "time.yaml",
         "case.yaml:1:10: the included file 'parts/time.yaml' cannot be read: No such file or directory\n"
         "  include: parts/time.yaml\n           ^"),
        ("parts/supports.yaml", "- {on", "# {on", "the included file 'supports.yaml' has no section or list"),
        ("parts/plate.yaml", "{include: supports.yaml}", "{include: supports.yaml, on: top}",
         "plate.yaml:3:21: the included file 'supports.yaml' has a list, which cannot stand beside other"),
        ("parts/times.yaml", "time:", "include: ../case.yaml\ntime:",
         "parts/times.yaml:1:10: the included file '../case.yaml' includes itself: case.yaml, times.yaml, case.yaml"),
        ("parts/times.yaml", "time:", "include: times.yaml\ntime:",
         "parts/times.yaml:1:10: the included file 'times.yaml' includes itself: case.yaml, times.yaml, times.yaml"),
        ("case.yaml", "structure:", "structure:\n  includes: a", "case.yaml:3:3: unknown setting 'includes'"),
    ],
)  # fmt: skip
def test_mistakes_are_located_in_their_files(file, old, new, message):
    Path("case.yaml").write_text(MAIN)
    text = Path(file).read_text()
    assert old in text
    Path(file).write_text(text.replace(old, new))
    assert message in str(refused(Path("case.yaml").read_text()))


def test_files_that_double_themselves_are_refused(monkeypatch):
    monkeypatch.setattr("fsci.case.include.MOST_VALUES", 1000)  # which any limit above does as well, in more time
    for level in range(30):
        Path(f"{level}.yaml").write_text("\n".join(f"{name}: {{include: {level + 1}.yaml}}" for name in "ab"))
    Path("30.yaml").write_text("{a: 1}")
    assert "makes more than 1000 values of the case" in str(refused("include: 0.yaml\n"))


def test_a_body_may_be_called_include():
    document = "structure: {bodies: {include: {mesh: {}}}}"
    Path("case.yaml").write_text(document)
    assert read_document(Path("case.yaml")).data == {"structure": {"bodies": {"include": {"mesh": {}}}}}


def test_schema_takes_a_file_for_a_section_or_a_list_of_sections():
    schema = json.loads(json_schema())
    body = schema["$defs"]["Body"]
    for part in (schema, body, body["properties"]["supports"], schema["$defs"]["Structure"]["properties"]["bodies"]):
        assert part["patternProperties"]["^include$"]["type"] == "string"
        assert "object" in part["type"]
    assert "required" not in body
    assert body["if"] == {"required": ["include"]}
    assert {"mesh", "material"} <= set(body["else"]["required"])
    assert "patternProperties" not in schema["$defs"]["Grid"]["properties"]["cells"]


def test_folder_of_the_case_is_where_names_count_from():
    """Also those in a file in another folder."""
    mesh = "shape: rectangle, size: [1, 1], cells: [2, 2], order: 1"
    Path("parts", "plate.yaml").write_text(PARTS["plate.yaml"].replace(mesh, "file: a.msh"))
    assert f"parts/plate.yaml:1:14: mesh file 'a.msh' not found in {Path().absolute()}\n" in str(refused(MAIN))
