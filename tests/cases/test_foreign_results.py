"""Results folders from somebody else: no link in them is followed, no file outside is read, written or deleted."""

import os
import shutil

import pytest
from programs import fsci
from small_cases import PLATE

from fsci.cli import execute

SECRET = "a file of the user\n"

#: what stands in the folder -> the commands that would read or write it
COMMANDS = {
    "resume": ("resume", "--set", "time.end=1.2"),
    "report": ("report",),
    "plot": ("plot",),
    "explain": ("explain",),
}
NAMES = (
    *("case.yaml", "log.txt", "history.csv", "summary.json", "report.html", "STOP", ".fsci-run", ".fsci-lock"),
    *("case.yaml.tmp", "history.csv.tmp", "report.html.tmp", "summary.json.tmp", "log.txt.tmp"),
    *("fields/plate.pvd", "fields/plate_000001.vtu", "fields/plate_000006.vtu.tmp", "fields/other.pvd"),
    *("checkpoint/checkpoint_000005.h5", "checkpoint/checkpoint_000006.h5.tmp", "pictures/mesh.png", "failure/x"),
    *("pictures/.fsci-pictures", "meshes/a/m.msh", "curves/a/f.csv"),
)
FOLDERS = ("fields", "checkpoint", "pictures", "failure", "failure/fields", "meshes", "curves")


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plate")
    (folder / "case.yaml").write_text(PLATE)
    assert execute(["run", str(folder), "-o", str(folder / "out")]) == 0
    return folder / "out"


@pytest.fixture
def out(results, tmp_path):
    shutil.copytree(results, tmp_path / "out")
    (tmp_path / "user").mkdir()
    (tmp_path / "user" / "victim").write_text(SECRET)
    return tmp_path / "out"


def assert_untouched(out):
    home = out.parent / "user"
    assert [path.name for path in home.iterdir()] == ["victim"]
    assert (home / "victim").read_text() == SECRET


def instead(path, target, make=os.symlink):
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.is_dir():
        shutil.rmtree(path)
    path.unlink(missing_ok=True)
    make(target, path)


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("name", NAMES)
def test_links_are_refused(out, name, command, capsys):
    instead(out / name, out.parent / "user" / "victim")
    verb, *options = COMMANDS[command]
    assert execute([verb, str(out), *options]) == 2
    assert f"{out / name}: is a link, and no link in a results folder is followed" in capsys.readouterr().err
    assert_untouched(out)


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("name", FOLDERS)
def test_folders_that_are_links_are_refused(out, name, command, capsys):
    instead(out / name, out.parent / "user")
    verb, *options = COMMANDS[command]
    assert execute([verb, str(out), *options]) == 2
    assert f"{out / name}: is a link" in capsys.readouterr().err
    assert_untouched(out)


@pytest.mark.parametrize("name", [*NAMES, *FOLDERS])
def test_a_new_run_follows_none(out, results, name, capsys):
    target = out.parent / "user" if name in FOLDERS else out.parent / "user" / "victim"
    instead(out / name, target)
    assert execute(["run", str(results.parent), "-o", str(out)]) == 2
    assert "is a link" in capsys.readouterr().err
    assert_untouched(out)


@pytest.mark.parametrize("name", ["log.txt", "history.csv", "fields/x", "case.yaml"])
def test_pipes_do_not_make_it_wait(out, name):
    instead(out / name, 0o600, make=lambda mode, path: os.mkfifo(path, mode))
    for verb, *options in COMMANDS.values():
        done = fsci(verb, out, *options, timeout=60)
        assert done.returncode == 2, done.stdout + done.stderr
        assert f"{out / name}: is neither a file nor a folder: remove it" in done.stderr


def test_folders_called_like_files(out, capsys):
    for name in (".fsci-lock", "report.html.tmp", "STOP"):
        (out / name).unlink(missing_ok=True)
        (out / name).mkdir()
        assert execute(["resume", str(out), "--set", "time.end=2"]) == 2
        assert capsys.readouterr().err == f"{out / name}: is a folder, not a file: remove it\n"
        (out / name).rmdir()
    (out / "pictures").write_text("a picture")
    assert execute(["plot", str(out)]) == 2
    assert capsys.readouterr().err == f"{out / 'pictures'}: is a file, not a folder: remove it\n"


def test_hard_links_are_not_written_into(out):
    for end, name in enumerate(("log.txt", "history.csv", "summary.json", "fields/plate.pvd"), 2):
        shutil.copy(out / name, out.parent / "copy")
        instead(out / name, out.parent / "copy", make=os.link)
        before = (out.parent / "copy").read_bytes()
        assert execute(["resume", str(out), "--set", f"time.end={end}"]) == 0
        assert (out.parent / "copy").read_bytes() == before
        (out.parent / "copy").unlink()


def test_the_folder_itself_may_be_a_link_and_so_may_files_of_the_user(out):
    (out.parent / "link").symlink_to(out)
    (out / "notes.txt").symlink_to(out.parent / "user" / "victim")
    assert execute(["resume", str(out.parent / "link"), "--set", "time.end=1.2"]) == 0
    assert execute(["report", str(out.parent / "link")]) == 0
    assert (out / "notes.txt").is_symlink()


NAMES_OF_FILES = ["../../user/victim", "../history.csv", "@/user/victim", "other_000001.vtu", "plate_000001.vtu/../x"]


@pytest.mark.parametrize("name", NAMES_OF_FILES)
def test_lists_of_outputs_name_no_other_files(out, name, capsys):
    name = name.replace("@", str(out.parent))
    listed = out / "fields" / "plate.pvd"
    text = listed.read_text()
    listed.write_text(text.replace("</Coll", f'<DataSet timestep="99" part="0" file="{name}"/></Coll'))
    before = sorted(out.rglob("*"))
    for verb, *options in (COMMANDS["resume"], COMMANDS["plot"], COMMANDS["report"]):
        assert execute([verb, str(out), *options]) == 2
        message = f"{listed}: names the file '{name}': a run lists only its own files here, plate_000001.vtu and so on"
        assert message in capsys.readouterr().err
    assert set(before) <= set(out.rglob("*"))
    assert_untouched(out)


def test_lists_of_pictures_name_no_other_files(out, results):
    """What no run can have drawn stays."""
    (out / "pictures").mkdir()
    mine = [out / "pictures" / "notes.txt", out / "thesis.png"]
    for path in mine:
        path.write_text("mine")
    (out / "pictures" / ".fsci-pictures").write_text("../../user/victim\n../thesis.png\nnotes.txt\n")
    assert execute(["run", str(results.parent), "-o", str(out)]) == 0
    assert all(path.exists() for path in mine)
    assert_untouched(out)


def test_checkpoints_have_no_links(out, capsys):
    import h5py

    from fsci.running.checkpoint import USER_BLOCK, checksum

    (path,) = (out / "checkpoint").glob("*.h5")
    with h5py.File(path, "r+") as file:
        file["state/more"] = h5py.ExternalLink(str(out.parent / "user" / "victim"), "x")
    with path.open("r+b") as file:
        file.write(checksum(path).ljust(USER_BLOCK, b"\0"))
    assert execute(["resume", str(out), "--set", "time.end=1.2"]) == 1
    assert "the checkpoint has a link, /state/more: a run did not write it" in capsys.readouterr().err
