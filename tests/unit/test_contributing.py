"""The page on contributing is true: its drawing names what is there, its table files and tables that exist."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "contributing.md").read_text()
SOURCES = {
    path: path.read_text() for folder in ("coupling", "solvers", "fsci") for path in (ROOT / folder).rglob("*.py")
}


def section(title: str) -> str:
    return PAGE.split(f"## {title}\n")[1].split("\n## ")[0]


def test_the_drawing_of_a_coupled_newton_step():
    """Methods are those of the ports, or of what stands between them."""
    drawing = section("One coupled Newton step").split("```")[1]
    ports = SOURCES[ROOT / "coupling" / "ports.py"] + SOURCES[ROOT / "solvers" / "newton.py"]
    called = set(re.findall(r"(?<![.\w'])([a-z_]{3,})\(", drawing))
    assert {"displacement", "row_transformations", "interface_entries", "update"} <= called
    assert [name for name in called if f"def {name}(" not in ports] == []
    for owner, method in re.findall(r"\b([A-Z]\w+)\.([a-z_]+)\b", drawing):
        defined = [text for text in SOURCES.values() if f"class {owner}" in text and f"def {method}(" in text]
        assert defined, f"{owner}.{method}"


def test_the_order_of_the_drawing_is_that_of_the_scheme():
    drawing = section("One coupled Newton step").split("```")[1]
    scheme = SOURCES[ROOT / "coupling" / "monolithic.py"]
    residual = scheme[scheme.index("def residual(self)") : scheme.index("def advance(self")]
    advance = scheme[scheme.index("def advance(self") : scheme.index("def _solve(self")]
    in_scheme = (
        (residual, ["flow.residual()", "coupled.force()", "solid.residual()"]),
        (advance, [f"{name}(" for name in ("right_side", "row_transformations", "missing", "recover", "update")]),
    )
    in_drawing = (
        ["-> r_f", "force()", "-> r_s"],
        [f"{name}(" for name in ("right_side", "row_transformations", "missing", "recover", "update")],
    )
    for (text, names), drawn in zip(in_scheme, in_drawing, strict=True):
        assert sorted(names, key=text.index) == names
        assert sorted(drawn, key=drawing.index) == drawn


def test_files_and_tables_of_where_do_i_add():
    rows = section("Where do I add").split("From Python you pass")[0]
    paths = {path for path in re.findall(r"`((?:solvers|coupling|fsci|cases)/[\w/.]*)`", rows) if "NAME" not in path}
    assert len(paths) > 20
    assert [path for path in paths if not (ROOT / path).exists()] == []
    for table in re.findall(r"`([A-Z_]{5,})`", rows):
        assert any(re.search(rf"^{table}\b", text, re.MULTILINE) for text in SOURCES.values()), table
