"""Do the tests notice a wrong operator? python tests/mutate.py [--count N] [--seed S] [--group NAME]

Replaces one random operator at a time (+ - * / < >) in forms, mortar, time schemes and geometry, runs the tests of that
part, and prints the mutants that pass all of them. Works in place, on a clean checkout; every file is put back.
"""

from __future__ import annotations

import argparse
import ast
import random
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
SWAPPED = {"+": "-", "-": "+", "*": "/", "/": "*", "<": ">", ">": "<"}

#: part -> (patterns of its sources, names of their tests, the fast ones first)
GROUPS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "flow": (
        tuple(f"solvers/fluid/terms/{name}.py" for name in ("forms", "nitsche", "boundary/patch_kinds")),
        (
            "fluid_patch", "fluid_tangent", "fluid_ghost", "fluid_covered_faces", "fluid_slip", "fluid_stretched",
            "fluid_nitsche", "fluid_slip_bodies", "fluid_film", "fluid_time", "fluid_reactions", "constants",
        ),
    ),
    "structure": (
        ("solvers/structure/forms.py", *(f"solvers/structure/materials/{name}.py" for name in (
            "material", "neo_hooke", "coup_neo_hooke", "mooney_rivlin", "st_venant_kirchhoff", "linear_elastic",
            "yeoh", "holzapfel_gasser_ogden", "ogden",
        )), "solvers/structure/relaxation.py"),
        (
            "structure_tangent", "structure_patch", "mixed_element", "elastic_constants", "linear_kinematics",
            "additions", "structure_probes", "relaxation",
        ),
    ),
    "time": (
        (
            "solvers/generalised_alpha.py", "solvers/structure/dynamics.py", "solvers/fluid/settings/time_scheme.py",
            "solvers/fluid/flow/history.py", "solvers/rigid/motion.py",
        ),
        (
            "additions", "rigid", "structure_time", "fluid_history", "fluid_time", "massless", "contact_motion",
            "contact_linear", "structure_springs", "structure_supports", "rigid_inertia", "mass_exchange", "viscosity",
        ),
    ),
    "mortar": (
        tuple(f"solvers/contact/{name}.py" for name in (
            "integration", "mortar", "slip", "terms", "linearise", "condense", "directions", "merge", "rims",
            "coverage", "sharp_edges", "law/*",
        )),
        ("contact_system", "contact_patch", "contact_rims", "contact_friction", "friction_held", "contact_held",
         "contact_several", "sharp_edges", "tying", "search", "friction_patch", "constants", "self_contact"),
    ),
    "cutting": (
        tuple(f"solvers/fluid/cut/{name}.py" for name in ("cut", "extension", "pockets", "weights")),
        ("fluid_extension", "pockets", "fluid_pockets_kept", "fluid_pieces", "fluid_patch", "fluid_entering",
         "carry_over", "fluid_slits", "fluid_overlaps", "fluid_history", "fluid_nested", "fluid_parallel"),
    ),
    "geometry": (
        ("solvers/cut_cells/*.py", "solvers/fluid/geometry/*.py"),
        ("cut_cells", "cut_cells_again", "cut_cells_closing", "cut_cells_oracles", "cell_regions", "fluid_pieces",
         "fluid_overlaps", "fluid_slits", "fluid_touching", "fluid_touching_space"),
    ),
    "thin": (
        ("solvers/fluid/geometry/thin/*.py",),
        ("fluid_thin", "fluid_thin_space", "fluid_thin_moving", "fluid_thin_space_moving", "fluid_touching",
         "fluid_thin_nested", "fluid_thin_periodic", "thin_rigid", "thin_elastic"),
    ),
    "films": (
        (
            "solvers/fluid/cut/film.py", "solvers/fluid/cut/gaps.py", "solvers/fluid/terms/gap_terms.py",
            *(f"solvers/fluid/terms/shape_derivatives/{name}.py" for name in (
                "film_crossings", "film_shape", "surface_integrands",
            )),
        ),
        ("film_crossings", "fluid_film", "fluid_film_shape", "fluid_gap", "fluid_gaps", "fluid_closing",
         "fsci_lubrication", "constants"),
    ),
    "poorly_cut": (
        ("solvers/fluid/terms/poorly_cut/*.py",),
        ("fluid_ghost", "fluid_extension", "fluid_film", "fluid_tangent", "fluid_patch", "fluid_stretched",
         "constants"),
    ),
    "closed_contact": (
        ("solvers/fluid/terms/closed_contact/*.py",),
        ("fluid_zone", "fluid_seepage", "fluid_zone_seepage", "fsci_hydrostatic", "coupling_blocks"),
    ),
    "kernels": (
        tuple(f"solvers/kernels/{name}.hpp" for name in (
            "facet_assembly", "facet_ball", "hidden_masters", "integrals", "dual_basis", "normals", "facet_derivatives",
            "plane_frame", "clipping",
        )),
        ("mortar_kernel", "nodal_normals", "mortar_derivatives", "contact_system"),
    ),
}  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """One operator of a file in another one's place."""

    path: Path
    at: int  #: characters before the operator
    operator: str

    @property
    def text(self) -> str:
        """The whole file."""
        text = self.path.read_text()
        return text[: self.at] + SWAPPED[self.operator] + text[self.at + 1 :]

    def __str__(self) -> str:
        before = self.path.read_text()[: self.at]
        number = before.count("\n")
        line, new = self.path.read_text().splitlines()[number], self.text.splitlines()[number]
        return f"{self.path.relative_to(ROOT)}:{number + 1}\n    {line.strip()}\n -> {new.strip()}"


def files(patterns: tuple[str, ...]) -> list[Path]:
    """What the patterns name, in an order that does not depend on the machine."""
    return [path for pattern in patterns for path in sorted(ROOT.glob(pattern))]


def mutants(path: Path) -> Iterator[Mutant]:
    """Of all operators in a file."""
    text = path.read_text()
    found = _of_python(text) if path.suffix == ".py" else _of_kernel(text)
    return (Mutant(path, at, text[at]) for at in found)


def _of_python(text: str) -> Iterator[int]:
    lines = text.encode().splitlines(keepends=True)
    starts = [sum(map(len, lines[:n])) for n in range(len(lines))]
    for node in ast.walk(ast.parse(text)):
        match node:
            case ast.BinOp(left, _, right) | ast.Compare(left, _, [right]):
                assert left.end_lineno is not None
                assert left.end_col_offset is not None
                begin = starts[left.end_lineno - 1] + left.end_col_offset
                between = text[begin : starts[right.lineno - 1] + right.col_offset]
                operator = between.strip(" ()\n")
                if operator in SWAPPED:
                    yield begin + between.index(operator)
            case ast.UnaryOp(ast.USub(), ast.Name() | ast.Call() | ast.Attribute() | ast.Subscript()):
                yield starts[node.lineno - 1] + node.col_offset


def _of_kernel(text: str) -> Iterator[int]:
    start = 0
    for line in text.splitlines(keepends=True):
        code = line.split("//")[0]
        if not code.lstrip().startswith(("#", "template", "static_assert", "for")):
            yield from (start + found.start() + 1 for found in re.finditer(r" [-+*/<>] ", code))
        start += len(line)


def survives(mutant: Mutant, tests: tuple[str, ...]) -> bool:
    """All tests pass with it."""
    original = mutant.path.read_text()
    try:
        mutant.path.write_text(mutant.text)
        if mutant.path.suffix == ".hpp" and not build():
            return False
        files = [str(path) for name in tests for path in ROOT.glob(f"tests/*/test_{name}.py")]
        run = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-m", "not slow", *files]
        try:
            return subprocess.run(run, cwd=ROOT, capture_output=True, timeout=900).returncode == 0
        except subprocess.TimeoutExpired:
            return False
    finally:
        mutant.path.write_text(original)


def build() -> bool:
    """Compile the kernels and put them where they are imported from."""
    from solvers import kernels

    (folder,) = (ROOT / "build").iterdir()
    done = subprocess.run(["cmake", "--build", str(folder)], capture_output=True)
    if done.returncode == 0:
        installed = Path(str(sys.modules[kernels.mortar.__module__].__file__))
        installed.unlink()
        shutil.copy(folder / installed.name, installed)
    return done.returncode == 0


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--count", type=int, default=50)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--group", choices=GROUPS, action="append")
    given = options.parse_args()
    if subprocess.run(["git", "diff", "--quiet"], cwd=ROOT).returncode:
        return print("there are changes that are not committed") or 2
    chance, left = random.Random(given.seed), []
    groups = given.group or list(GROUPS)
    for number in range(given.count):
        sources, tests = GROUPS[groups[number % len(groups)]]
        mutant = chance.choice([one for path in files(sources) for one in mutants(path)])
        passed = survives(mutant, tests)
        left += [mutant] * passed
        print(f"{number + 1:3d} {'SURVIVES' if passed else 'caught  '} {mutant}", flush=True)
    if any(name == "kernels" for name in groups):
        build()
    print(f"{len(left)} of {given.count} survive")
    return 1 if left else 0


if __name__ == "__main__":
    sys.exit(main())
