"""The commands that deal with case files: new, check, schema, and how run, resume and plot are called."""

import json
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from fsci.case import load_case
from fsci.cli import execute

ROOT = Path(__file__).parents[2]


pytestmark = pytest.mark.usefixtures("in_new_folder")


@pytest.fixture
def beam():
    assert execute(["new", "beam"]) == 0
    return Path("beam")


@pytest.fixture
def calls(monkeypatch):
    """What the commands hand to the run loop and to the pictures, which are replaced."""
    made = []

    def note(name, result):
        def function(*arguments, **options):
            made.append((name, arguments, options))
            return result

        return function

    run = SimpleNamespace(run_case=note("run", 1), resume_run=note("resume", 3))
    picture = SimpleNamespace(plot_run=note("plot", [Path("a.png"), Path("b.png")]))
    monkeypatch.setitem(sys.modules, "fsci.running.run", run)
    monkeypatch.setitem(sys.modules, "fsci.plot.picture", picture)
    return made


def test_new_writes_a_valid_case_without_warnings(capsys):
    assert execute(["new", "beam"]) == 0
    beam = Path("beam")
    case = load_case(beam)
    assert case.warnings == ()
    assert case.title == "beam"
    assert "fsci run beam" in (beam / "README.md").read_text()
    assert "next: fsci run beam" in capsys.readouterr().out


def test_commented_settings_of_the_new_case_are_valid_too(beam):
    text = (beam / "case.yaml").read_text()
    before, after = text.split("expressions of x, y, z and t:\n")
    loads, rest = after.split("\n\n", 1)
    (beam / "case.yaml").write_text(before + "\n" + loads.replace("# ", "") + "\n\n" + rest)
    body = load_case(beam).structure.bodies["beam"]
    assert (len(body.tractions), len(body.pressures)) == (1, 1)


def test_new_writes_a_flow_too():
    assert execute(["new", "channel", "--template", "channel"]) == 0
    case = load_case("channel")
    assert case.warnings == ()
    assert case.title == "channel"
    assert case.structure is None
    text = Path("channel/case.yaml").read_text()
    Path("channel/case.yaml").write_text(text.replace("# motion:", "motion:"))
    assert load_case("channel").fluid.bodies["cylinder"].motion is not None
    assert "fsci run channel" in Path("channel/README.md").read_text()


def test_new_writes_contact_in_a_flow_too():
    assert execute(["new", "ball", "--template", "ball"]) == 0
    case = load_case("ball")
    assert case.warnings == ()
    assert case.coupling is not None
    assert list(case.contact.pairs) == ["bottom"]


def test_demo_takes_its_own_unchanged_case_alone(capsys):
    assert execute(["new", "ball", "--template", "ball"]) == 0
    Path("ball/case.yaml").write_text("mine")
    assert execute(["demo"]) == 2
    message = "fsci demo: 'ball' is there, and is not this case as it was written: name another folder\n"
    assert capsys.readouterr().err == message
    assert Path("ball/case.yaml").read_text() == "mine"


def test_demo_runs_its_case_and_draws_what_is_finished(calls, monkeypatch, capsys):
    """Of a run that fails or stops nothing is drawn. The case that is there is taken again."""
    monkeypatch.delitem(sys.modules, "fsci.demo", raising=False)
    assert execute(["demo", "drop"]) == 1
    assert [(name, arguments[1:]) for name, arguments, _ in calls] == [("run", (Path("results/drop"),))]
    monkeypatch.setattr(sys.modules["fsci.running.run"], "run_case", lambda case, out: 0)
    monkeypatch.delitem(sys.modules, "fsci.demo")
    assert execute(["demo", "drop"]) == 0
    assert calls[1:] == [("plot", (Path("results/drop"),), {"movie": True})]
    assert capsys.readouterr().out.splitlines()[-2:] == [
        "$ fsci plot results/drop --movie",
        "Change drop/case.yaml and run it again, or open results/drop/fields in ParaView.",
    ]


def test_new_overwrites_nothing(beam, capsys):
    (beam / "case.yaml").write_text("mine")
    assert execute(["new", "beam"]) == 2
    assert capsys.readouterr().err == "fsci new: cannot make the folder 'beam': File exists\n"
    assert (beam / "case.yaml").read_text() == "mine"


def test_check_describes_a_good_case(beam, capsys):
    capsys.readouterr()
    assert execute(["check", "beam"]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("beam/case.yaml\n")
    assert "0 to 0.4 s, 100 steps of 0.004" in out
    assert "dofs       410" in out  # (2*20 + 1)(2*2 + 1) nodes
    assert "columns    tip.x .y, clamp.x .y, energy.kinetic, energy.internal, energy.work, energy.total, struct" in out
    assert out.endswith("\nok\n")
    assert err == ""
    assert execute(["check", "beam/case.yaml"]) == 0


def test_check_warns(beam, capsys):
    assert execute(["check", "beam", "--set", "time.step=1"]) == 0
    out, err = capsys.readouterr()
    assert err == "warning: --set time.step=1: the step 1 is longer than the run, 0.4\n"
    assert out.endswith("ok\n")


def test_check_refuses_a_bad_case(beam, capsys):
    capsys.readouterr()
    assert execute(["check", "beam", "--set", "time.end=0.2", "--set", "time.ende=1"]) == 2
    assert capsys.readouterr() == ("", "--set time.ende=1: unknown setting 'ende'; did you mean 'end'?\n")
    assert execute(["check", "nothing"]) == 2
    assert capsys.readouterr().err == "nothing: cannot be read: No such file or directory\n"


def test_schema(capsys):
    assert execute(["schema"]) == 0
    assert json.loads(capsys.readouterr().out)["title"] == "Case of fsci"
    assert execute(["schema", "--markdown"]) == 0
    assert capsys.readouterr().out.startswith("# Input reference\n")


def test_run_takes_overrides_and_the_folder_for_results(beam, calls):
    assert execute(["run", "beam", "-o", "out", "--set", "time.end=0.2"]) == 1
    ((name, (case, out), _),) = calls
    assert (name, case.time.end, out) == ("run", 0.2, Path("out"))


@pytest.mark.parametrize("path", ["beam", "beam/", "beam/case.yaml", "beam/../beam"])
def test_results_go_to_the_name_of_the_case(beam, calls, path):
    execute(["run", path])
    assert calls[0][1][1].resolve() == Path("results/beam").resolve()


@pytest.mark.parametrize("name", ["stiff.yaml", "stiff.fsci.yaml"])
def test_cases_in_one_folder_have_results_of_their_own(beam, calls, name):
    (beam / name).write_text((beam / "case.yaml").read_text())
    execute(["run", str(beam / name)])
    assert calls[0][1][1] == Path("results/stiff")


@pytest.mark.parametrize("words", ["schema", "check beam"])
def test_a_reader_that_stops_ends_a_command_without_a_word(beam, words):
    """As `fsci schema | head`: the pipe has no reader any more."""
    read, write = os.pipe()
    os.close(read)
    run = subprocess.Popen([sys.executable, "-m", "fsci", *words.split()], stdout=write, stderr=subprocess.PIPE)
    os.close(write)
    _, said = run.communicate(timeout=60)
    assert b"Error" not in said
    assert b"pipe" not in said
    assert run.returncode == 1


def test_run_refuses_a_bad_case_before_it_starts(beam, calls, capsys):
    assert execute(["run", "beam", "--set", "time.step=0"]) == 2
    assert calls == []
    assert capsys.readouterr().err == "--set time.step=0: 'step' must be greater than 0, not 0\n"


def test_resume_and_plot(calls, capsys):
    assert execute(["resume", "out"]) == 3
    assert execute(["resume", "out", "--set", "time.end=2"]) == 3
    Path("out").mkdir()
    assert execute(["plot", "out", "--movie", "--field", "velocity", "--time", "0.5", "--time", "1"]) == 0
    assert capsys.readouterr().out == "a.png\nb.png\n"
    assert calls == [
        ("resume", (Path("out"), []), {}),
        ("resume", (Path("out"), [("time.end", "2")]), {}),
        (
            "plot",
            (Path("out"),),
            {
                "movie": True,
                "field": "velocity",
                "times": [0.5, 1.0],
                "scale": 1.0,
                "mirrors": [],
                "lines": [],
                "surfaces": [],
            },
        ),
    ]


def test_plot_of_both_sides(calls):
    Path("out").mkdir()
    assert execute(["plot", "out", "--mirror", "x=0", "--mirror", "y=1"]) == 0
    assert calls[0][2]["mirrors"] == ["x=0", "y=1"]


def test_plot_without_results(calls, capsys):
    assert execute(["plot", "out"]) == 2
    assert (calls, capsys.readouterr().err) == ([], "fsci plot: there is no folder 'out'\n")


@pytest.mark.parametrize(
    "arguments", [[], ["runn"], ["run"], ["check", "a", "--set", "x"], ["new"], ["check", "--sett=1", "a"]]
)
def test_wrong_commands_explain_themselves(arguments, capsys):
    with pytest.raises(SystemExit) as caught:
        execute(arguments)
    assert caught.value.code == 2
    assert capsys.readouterr().err.startswith("usage: fsci")


def test_help_shows_the_first_steps(capsys):
    with pytest.raises(SystemExit):
        execute(["--help"])
    assert "fsci new beam" in capsys.readouterr().out


def test_check_and_schema_import_nothing_heavy(beam):
    program = (
        "import sys; from fsci.cli import execute; execute(['check', 'beam']); execute(['schema'])\n"
        "heavy = {'dolfinx', 'mpi4py', 'petsc4py', 'ufl', 'gmsh', 'meshio', 'pyvista', 'h5py', 'scipy', 'rich'}\n"
        "print('heavy:', sorted(heavy & {name.split('.')[0] for name in sys.modules}))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, env={"PYTHONPATH": str(ROOT)}, check=True
    )
    assert done.stdout.splitlines()[-1] == "heavy: []"


def test_one_process_of_several_reports_a_bad_case(beam):
    program = "from fsci.cli import main; main()"
    command = ["mpirun", "-n", "2", sys.executable, "-c", program]
    root = {
        "OMPI_ALLOW_RUN_AS_ROOT": "1",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
        "OMPI_MCA_rmaps_base_oversubscribe": "1",
    }
    done = subprocess.run(
        [*command, "run", "beam", "--set", "time.step=0"],
        capture_output=True,
        text=True,
        env=os.environ | root | {"PYTHONPATH": str(ROOT)},
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.count("'step' must be greater than 0") == 1
