"""A run deletes and overwrites nothing that a run did not write."""

import pytest
from programs import fsci
from small_cases import BLOCK

from fsci.case import CaseError, load_case
from fsci.running.results_folder import list_pictures, prepare_folder

FOREIGN = [
    "case.yaml",
    "history.csv",
    "thesis.tex",
    "fields/photo.vtu",
    "fields/mesh_000001.vtu",
    "checkpoint/notes.txt",
    "failure/why.txt",
    "failure/fields/x.vtu",
    "pictures/me.png",
]


@pytest.fixture
def case(tmp_path):
    (tmp_path / "case").mkdir()
    (tmp_path / "case" / "case.yaml").write_text(BLOCK)
    return load_case(tmp_path / "case")


def put(folder, names):
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(f"my {name}")


def texts(folder):
    return sorted(path.read_text() for path in folder.rglob("*") if path.is_file())


@pytest.mark.parametrize("name", FOREIGN)
def test_a_folder_with_other_files_is_refused(case, tmp_path, name):
    put(tmp_path / "out", [name])
    with pytest.raises(CaseError, match="this folder has files that no run wrote; choose another one"):
        prepare_folder(case, tmp_path / "out")
    assert texts(tmp_path / "out") == [f"my {name}"]


def test_the_folder_of_the_case_is_refused(case, tmp_path):
    with pytest.raises(CaseError, match="this folder is the folder of the case itself"):
        prepare_folder(load_case(tmp_path / "case", [("time.end", "2")]), tmp_path / "case")
    assert (tmp_path / "case" / "case.yaml").read_text() == BLOCK


def test_force_keeps_what_was_there(case, tmp_path):
    put(tmp_path / "out", FOREIGN)
    prepare_folder(case, tmp_path / "out", force=True)
    assert (tmp_path / "out" / "case.yaml").read_text() == BLOCK
    assert set(texts(tmp_path / "out")) >= {f"my {name}" for name in FOREIGN}
    assert (tmp_path / "out" / "fields.old" / "photo.vtu").is_file()


def test_force_in_the_folder_of_the_case_keeps_the_case(case, tmp_path):
    folder = tmp_path / "case"
    prepare_folder(load_case(folder, [("time.end", "2")]), folder, force=True)
    assert (folder / "case.yaml.old").read_text() == BLOCK
    assert load_case(folder).time.end == 2


def test_another_run_removes_only_what_the_last_one_wrote(case, tmp_path):
    out = tmp_path / "out"
    prepare_folder(case, out)
    put(out, [name for name in FOREIGN if "/" in name])
    written = [
        "fields/block.pvd",
        "fields/block_000001.vtu",
        "checkpoint/checkpoint_000001.h5",
        "failure/checkpoint_000001.h5",
        "failure/failure.json",
        "pictures/final_velocity.png",
        "summary.json",
    ]
    put(out, written)
    list_pictures(out / "pictures", [out / "pictures" / "final_velocity.png"])
    prepare_folder(case, out)
    assert not [name for name in written if (out / name).exists()]
    assert [name for name in FOREIGN if "/" in name and not (out / name).exists()] == []


def test_a_file_instead_of_a_folder(case, tmp_path):
    (tmp_path / "out").write_text("mine")
    with pytest.raises(CaseError, match="cannot write here: File exists"):
        prepare_folder(case, tmp_path / "out")


def test_refused_on_all_processes(case, tmp_path):
    put(tmp_path / "out", ["thesis.tex"])
    run = fsci("run", tmp_path / "case", "-o", tmp_path / "out", processes=2, timeout=60)
    assert run.returncode == 2, run.stdout + run.stderr
    assert run.stderr.count("this folder has files that no run wrote") == 1
    assert "Traceback" not in run.stderr
