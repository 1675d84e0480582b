"""The results in the folder of a run."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fsci.case.errors import did_you_mean
from fsci.running.files import refused, require_own
from fsci.running.history import History, read_history
from fsci.running.output import write_vtu
from fsci.running.vtkhdf import VTKHDF_FILE, read_step, read_times


@dataclass(frozen=True)
class Results:
    """What the folder of a run holds."""

    folder: Path
    history: History  #: name of a column -> values, one for each step
    summary: Mapping[str, Any]  #: as in summary.json; empty while the run is under way

    def __getitem__(self, column: str) -> NDArray[np.float64]:
        """A column of the history, such as "time" or "drag.x", shape (steps,). Raises KeyError with what there is."""
        if column not in self.history:
            near = did_you_mean(column, self.history)
            raise KeyError(
                f"no column '{column}' in {self.folder / 'history.csv'}{near}; it has {', '.join(self.history)}"
            )
        return self.history[column]

    def fields(self, time: float | None = None) -> dict[str, Any]:
        """Name of a body, or fluid -> pyvista mesh at the output time nearest to `time` [s], by default the last."""
        import pyvista

        found = {}
        if (packed := self.folder / "fields" / VTKHDF_FILE).is_file():
            times = np.asarray(read_times(packed))
            number = len(times) - 1 if time is None else int(np.argmin(np.abs(times - time)))
            with tempfile.TemporaryDirectory() as folder:
                for snapshot in read_step(packed, number):
                    write_vtu(path := Path(folder) / f"{snapshot.name}.vtu", snapshot)
                    found[snapshot.name] = pyvista.read(path)
        for collection in sorted((self.folder / "fields").glob("*.pvd")):
            reader: Any = pyvista.get_reader(collection)
            times = np.asarray(reader.time_values)
            reader.set_active_time_value(times[-1] if time is None else times[np.argmin(np.abs(times - time))])
            found[collection.stem] = reader.read()[0]
        return found


def read_results(folder: Path) -> Results:
    """Raises CaseError for a folder without results."""
    if not (folder / "history.csv").is_file():
        raise refused(folder, "has no results of a run")
    require_own(folder)
    summary = folder / "summary.json"
    known = json.loads(summary.read_text()) if summary.exists() else {}
    return Results(folder, read_history(folder / "history.csv"), known)
