"""Mutated tiny cases, built and stepped: what `test_run_fuzz.py` takes a sample of."""

from __future__ import annotations

import contextlib
import io
import os
import sys
import tempfile
from pathlib import Path

from fsci.stress.mutants import mutant


def trouble(text: str, folder: Path) -> str:
    """What a user should not see when the case runs for one step; nothing if all is well."""
    from fsci.case import CaseError, load_case
    from fsci.cli import execute

    (folder / "case.yaml").write_text(text)
    settings: list[str] = []
    with contextlib.suppress(CaseError):  # the run says it too
        case = load_case(folder)
        if (case.time.end - case.time.start) / case.time.step > 2:
            settings = ["--set", f"time.end={case.time.start + case.time.step!r}"]
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = execute(["run", str(folder), "-o", str(folder / "out"), "--force", *settings])
    said = out.getvalue() + err.getvalue()
    if code not in (0, 1, 2) or "Traceback" in said:
        return f"exit code {code}: {said[-2000:]}"
    if code != 0 and not said.strip():
        return f"exit code {code} without a word"
    return ""


def main() -> None:
    import traceback

    for seed in range(int(sys.argv[1]), int(sys.argv[2])):
        text = mutant(seed)
        if text is None:
            continue
        with tempfile.TemporaryDirectory() as folder:
            os.write(2, f"{seed}\n".encode())
            try:
                found = trouble(text, Path(folder))
            except BaseException:
                found = traceback.format_exc()[-1500:]
            if found:
                print(f"--- {seed}\n{found}", flush=True)


if __name__ == "__main__":
    main()
