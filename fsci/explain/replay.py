"""A results folder from which the failed step alone can be computed again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from fsci.case import load_case
from fsci.running.checkpoint import list_checkpoints
from fsci.running.files import MARKER, copy_file, write_text
from fsci.running.kept_case import keep_case
from fsci.running.results_folder import MARKER_TEXT


def write_replay(failure: Path, folder: Path, what: dict[str, Any]) -> Path:
    """Make `folder` of the case, meshes and state in the folder of a failure, for this step and nothing else.

    `fsci resume` computes it then. Raises FileExistsError, and FileNotFoundError without a checkpoint.
    """
    checkpoints = list_checkpoints(failure)
    if not checkpoints:
        raise FileNotFoundError(f"no checkpoint in {failure}")
    folder.mkdir(parents=True)
    keep_case(load_case(failure), folder)
    changes = {
        "time.step": what["dt"],
        "time.end": what["time"] + what["dt"],
        "time.retry.halvings": 0,
        "output.residuals": [what["step"]],
        "verify": [],
    }
    case = load_case(folder)
    write_text(folder / "case.yaml", case.dump([(name, json.dumps(value)) for name, value in changes.items()]))
    write_text(folder / MARKER, MARKER_TEXT)
    (folder / "checkpoint").mkdir()
    copy_file(checkpoints[0], folder / "checkpoint" / checkpoints[0].name)
    return folder
