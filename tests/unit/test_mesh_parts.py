"""The files that a mesh file names are found, whatever else it says, and none that are no files are opened."""

import os
from types import SimpleNamespace

import pytest
from case_mistakes import first_lines, refused

from fsci.meshes.mesh import MeshError, build_mesh
from fsci.meshes.parts import all_files

#: file -> its text, and the names of all files that belong to the first one
TREES = {
    "script": (
        {
            "a.geo": '// Include "no.txt";\nInclude "b.txt"; Merge "sub/c.step"; x = "b.txt "; y = "b";',
            "b.txt": "ShapeFromFile('sub/d.brep');\nField[1].FileName = \"../far.dat\";",
            "../far.dat": "1 2 3",
            "sub/c.step": "'sub/e.txt'",
            "sub/d.brep": "",
            "sub/e.txt": "",
            "no.txt": "",
        },
        ["../far.dat", "a.geo", "b.txt", "sub/c.step", "sub/d.brep"],
    ),
    "options of parts": (
        {"a.geo": 'Include "b.txt";', "b.txt": "", "b.txt.opt": "", "a.geo.opt": 'Include "c";', "c": ""},
        ["a.geo", "a.geo.opt", "b.txt", "b.txt.opt", "c"],
    ),
    "a circle": ({"a.geo": 'Include "b.txt";', "b.txt": 'Include "a.geo";'}, ["a.geo", "b.txt"]),
    "mesh of gmsh": ({"a.msh": '$MeshFormat "b.txt"', "b.txt": "", "a.msh.opt": ""}, ["a.msh", "a.msh.opt"]),
    "XDMF": (
        {
            "a.xdmf": '<DataItem Format="HDF">a.h5:/data0</DataItem><DataItem Format="HDF">\n  a.h5:/data1\n</DataItem>'
            '<DataItem Format="Binary">sub/b.bin</DataItem><DataItem Format="XML">1 2 3</DataItem>',
            "a.h5": "",
            "sub/b.bin": "",
            "1 2 3": "a file of data's name",
        },
        ["1 2 3", "a.h5", "a.xdmf", "sub/b.bin"],
    ),
    "Abaqus": (
        {
            "a.inp": "*Head\n b.inp\n*INCLUDE, input = b.inp \r\n*NODE\n",
            "b.inp": "*include,INPUT=c.inp",
            "c.inp": "",
        },
        ["a.inp", "b.inp", "c.inp"],
    ),
    "Tetgen": ({"a.ele": "", "a.node": "", "a.face": ""}, ["a.ele", "a.node"]),
    "DOLFIN": ({"a.xml": "", "a_regions.xml": "", "b.xml": ""}, ["a.xml", "a_regions.xml"]),
    "another format": ({"a.vtk": '"b" c', "b": "", "c": ""}, ["a.vtk"]),
    "a name that is too long": ({"a.geo": f'x = "{"y" * 5000}";'}, ["a.geo"]),
    "names in other alphabets": (
        {"a.geo": 'Include "gr\u00f6\u00dfe.txt";', "gr\u00f6\u00dfe.txt": ""},
        ["a.geo", "gr\u00f6\u00dfe.txt"],
    ),
}


@pytest.mark.parametrize("name", TREES)
def test_parts(name, tmp_path):
    files, expected = TREES[name]
    home = tmp_path / "home"
    for file, text in files.items():
        (home / file).parent.mkdir(parents=True, exist_ok=True)
        (home / file).write_text(text, encoding="utf-8")
    found = all_files(home / next(iter(files)))
    assert sorted(os.path.relpath(path, home) for path in found) == expected
    for path, named in found.items():
        for one in named:
            if one.span is not None:
                text = path.read_bytes()[slice(*one.span)].decode()
                assert (path.parent / text).samefile(one.file)


def test_parts_that_are_no_files_are_not_opened(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "a.geo").write_text('Include "pipe";\n')
    with pytest.raises(MeshError, match="pipe is not a file"):
        build_mesh(SimpleNamespace(file="a.geo"), tmp_path)


@pytest.mark.parametrize("name", ["/dev/zero", "pipe.msh", "folder", "pipe.geo"])
def test_meshes_that_are_no_files(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe.msh")
    os.mkfifo("pipe.geo")
    os.mkdir("folder")
    case = f"""\
time: {{step: 1, end: 1}}
structure:
  bodies:
    a:
      mesh: {{file: {name}}}
      material: {{law: neo_hooke, E: 1, nu: 0}}
"""
    assert first_lines(refused(case)) == [f"case.yaml:5:20: mesh file '{name}' is not a file"]


def test_the_case_is_no_file(tmp_path, capsys):
    from fsci.cli import execute

    (tmp_path / "case.yaml").mkdir()
    assert execute(["check", str(tmp_path)]) == 2
    assert capsys.readouterr().err == f"{tmp_path / 'case.yaml'}: is not a file\n"
