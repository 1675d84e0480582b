"""The table of constants: every number with a name in solvers and coupling is in it, and says what it is and why."""

import importlib.util
from collections import defaultdict

from docs_pages import ROOT

_spec = importlib.util.spec_from_file_location("make_constants", ROOT / "docs" / "make_constants.py")
make_constants = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(make_constants)


def test_every_constant_says_why():
    """A comment before it, or behind it in its line."""
    assert [f"{one.file}: {one.name}" for one in make_constants.constants() if len(one.why) < 10] == []


def test_the_page_has_every_constant():
    rows = [line for line in make_constants.page().splitlines() if line.startswith("| `")]
    assert len(rows) == len(make_constants.constants()) > 100
    assert "| `OPPOSED` | `-0.5` | Product of the unit normals below which facets can touch" in "\n".join(rows)


def test_a_name_has_one_meaning():
    """No name of a constant is defined twice: what is the same is imported. Scenes of bench and stress stand alone."""
    defined = defaultdict(list)
    for package in ("solvers", "coupling", "fsci"):
        for path in sorted((ROOT / package).rglob("*.py")):
            if path.relative_to(ROOT).parts[:2] not in (("fsci", "bench"), ("fsci", "stress")):
                for _, name, _ in make_constants.assigned(path.read_text()):
                    defined[name].append(path.name)
    assert {name: files for name, files in defined.items() if len(files) > 1} == {}


def test_constants_of_a_file_in_python():
    text = """
#: Share that counts,
#: from 1 to 10 the same.
SHARE = 0.5
AROUND: int = 3  #: layers
LIMIT = {2: 400, 3: np.sqrt(0.5)}
NAMES = {1: "one", 2: "two"}
WORD, OTHER = "a", (True, None)
LEAST, MOST = 0.5, 2.0  #: bounds
_PRIVATE = 1.0
local = 2.0
"""
    assert list(make_constants.in_python(text)) == [
        ("SHARE", "0.5", "Share that counts, from 1 to 10 the same."),
        ("AROUND", "3", "layers"),
        ("LIMIT", "{2: 400, 3: np.sqrt(0.5)}", ""),
        ("LEAST", "0.5", "bounds"),
        ("MOST", "2.0", "bounds"),
    ]


def test_constants_of_a_kernel():
    text = """
// Distance that is none.
constexpr double close = 1e-9;
    static constexpr double whole = order == 1 ? 1e-2 : 0.25;  // share of a facet
constexpr double other = tri6_blend;
constexpr double centre[2] = {0.0, 1.0};
"""
    assert list(make_constants.in_kernel(text)) == [
        ("close", "1e-9", "Distance that is none."),
        ("whole", "order == 1 ? 1e-2 : 0.25", "share of a facet"),
    ]
