"""Gmsh scripts that would run programs or write files are refused before gmsh reads them."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from fsci.meshes.mesh import MeshError, build_mesh
from fsci.meshes.scripts import RefusedScript, require_harmless

TRIANGLE = """\
Point(1) = {0, 0, 0, 1}; Point(2) = {1, 0, 0, 1}; Point(3) = {0, 1, 0, 1};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 1}; Curve Loop(1) = {1, 2, 3}; Plane Surface(1) = {1};
"""
RULE = "the mesh script of a case must not run programs or write files"

#: what a script says besides, and why it is refused; each makes a file if gmsh reads it (4.15)
HARMFUL = [
    ('SystemCall "touch MADE";', f"part.geo:3: 'SystemCall' runs a program: {RULE}"),
    ('\n System "touch MADE";', f"part.geo:4: 'System' runs a program: {RULE}"),
    ('If(1) NonBlockingSystemCall "touch MADE"; EndIf', "part.geo:3: 'NonBlockingSystemCall' runs a program"),
    ('OnelabRun("x", "touch MADE");', "part.geo:3: 'OnelabRun' runs a program"),
    ('Field[1] = ExternalProcess; Field[1].CommandLine = "touch MADE";', "'ExternalProcess' runs a program"),
    ('StringToName["SystemCall"] "touch MADE";', "'StringToName' may name any command"),
    ('S2N["SystemCall"] "touch MADE";', "'S2N' may name any command"),
    ('Printf("hello") > "MADE";', "'Printf' writes a file"),
    ('Printf("%g", (3 > 2)) >> "MADE";', "'Printf' writes a file"),
    ('Save "MADE.msh";', "'Save' writes a file"),
    ('Print "MADE.msh";', "'Print' writes a file"),
    ('CreateDir "MADE";', "'CreateDir' writes a file"),
    ('Include "other.txt";', f"other.txt:2: 'SystemCall' runs a program: {RULE}"),
    ('Merge "other.txt";', "other.txt:2: 'SystemCall' runs a program"),
    ('Include Str("other.txt");', "part.geo:3: 'Include' needs the plain name of a file in quotes"),
    ('Merge StrCat("other", ".txt");', "part.geo:3: 'Merge' needs the plain name of a file in quotes"),
    ('Merge "packed.msh.gz";', "packed.msh.gz: gmsh runs a program to read a compressed file: unpack it"),
    # a loop jumps to the beginning of the line after it
    ('For i In {1:2} /*\nSystemCall "touch MADE"; */ EndFor', "part.geo:3: a comment of several lines must begin"),
    ('a = "\n"; SystemCall "touch MADE";', "part.geo:3: a text must end in its line"),
    (f'a = "{"x" * 1100} SystemCall "touch MADE"; "', "part.geo:3: a text must end in its line"),
    ('/* SystemCall "touch MADE";', "part.geo:3: this comment or text has no end"),
    ('a = "b;', "part.geo:3: this comment or text has no end"),
    ('// \0\nSystemCall "touch MADE";', "part.geo:3: this comment or text has no end"),
]


@pytest.mark.parametrize(("script", "message"), HARMFUL)
def test_harmful_scripts_are_refused(script, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("part.geo").write_text(TRIANGLE + script + "\n")
    Path("other.txt").write_text('\nSystemCall "touch MADE";\n')
    Path("packed.msh.gz").write_bytes(b"")
    before = sorted(tmp_path.iterdir())
    with pytest.raises(MeshError) as error:
        build_mesh(SimpleNamespace(file="part.geo"), tmp_path)
    assert message in str(error.value)
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("name", ["part.msh", "part.geo.opt", "part.msh.opt"])
def test_scripts_in_disguise_are_refused(name, tmp_path):
    """A .msh file that is a script, and the options that gmsh reads along with a file."""
    (tmp_path / "part.geo").write_text(TRIANGLE)
    (tmp_path / "part.msh").write_text("$MeshFormat\n")
    (tmp_path / name).write_text('SystemCall "touch MADE";\n')
    with pytest.raises(RefusedScript, match=f"{name}:1: 'SystemCall' runs a program"):
        require_harmless(tmp_path / name.removesuffix(".opt"))


def test_harmless_scripts_are_read(tmp_path):
    """The words in comments and texts, loops and macros, and files that the script includes."""
    script = (
        TRIANGLE
        + """\
/* The System of coordinates;
   don't Save "me" */
Include "sizes.txt"; // SystemCall "nothing";
Macro Divide
  For i In {1:2} // Print
    n += 1;
  EndFor
Return
Call Divide;
If (n > 2) Printf("System: %g cells", n); EndIf
Transfinite Curve {1:3} = n + 1; Physical Surface("Save") = {1};
"""
    )
    (tmp_path / "part.geo").write_text(script)
    (tmp_path / "sizes.txt").write_text("n = 1;\n")
    mesh = build_mesh(SimpleNamespace(file="part.geo"), tmp_path)
    assert set(mesh.regions) == {"Save"}
    for path in Path(__file__).parents[2].glob("cases/*/*.geo"):
        require_harmless(path)


def test_a_last_line_that_gmsh_does_not_read_whole(tmp_path):
    """With one statement it does; a line break helps."""
    script = tmp_path / "part.geo"
    out = "Extrude {0, 0, 1} { Surface{1}; Layers{2}; };"
    for end in ('Physical Surface("a") = {1};', "// a; b;", "a = 1; b = 2;\n", out):
        script.write_text(TRIANGLE + end)
        require_harmless(script)
    script.write_text(TRIANGLE + 'Physical Curve("a") = {1}; Physical Surface("b") = {1};')
    with pytest.raises(RefusedScript) as error:
        require_harmless(script)
    assert str(error.value) == (
        "part.geo:3: gmsh reads the first statement of this line only: put a line break at its end"
    )
