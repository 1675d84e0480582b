"""Steps of small problems: nothing is looked up that the first step has found, and 138 unknowns take 10 ms at most."""

import time

import ffcx.codegeneration.jit
import pytest
from small_scenes import BEAM

import fsci.running.run
from fsci.case import load_case

CASE = (
    BEAM
    + """\
probes:
  tip: {quantity: displacement, at: [2, 0.25]}
  energy: {quantity: energy}
"""
)


@pytest.fixture
def steps(tmp_path, monkeypatch):
    """Run some steps; what they took, and how often the compiler's cache was asked since the first one."""
    asked, cpu = [], []
    names = {"compile_forms", "compile_elements", "compile_expressions"} & set(dir(ffcx.codegeneration.jit))
    for name in names:
        original = getattr(ffcx.codegeneration.jit, name)
        monkeypatch.setattr(ffcx.codegeneration.jit, name, lambda *a, f=original, **k: (asked.append(a), f(*a, **k))[1])
    one_step = fsci.running.run.Run.take_step

    def timed(run):
        begin = time.process_time()
        one_step(run)
        cpu.append(time.process_time() - begin)
        if run.clock.step == 1:
            asked.clear()

    monkeypatch.setattr(fsci.running.run.Run, "take_step", timed)

    def run(end):
        (tmp_path / "case.yaml").write_text(CASE)
        case = load_case(tmp_path / "case.yaml", [("time.end", str(end))])
        assert fsci.running.run.run_case(case, tmp_path / "out") == 0
        return cpu, asked

    return run


def test_nothing_is_compiled_or_looked_up_after_the_first_step(steps):
    cpu, asked = steps(0.2)
    assert len(cpu) == 4
    assert not asked


@pytest.mark.slow
def test_138_unknowns_take_10_ms(steps):
    cpu, _ = steps(5.0)
    assert sum(cpu[1:]) / len(cpu[1:]) < 0.010
