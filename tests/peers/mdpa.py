"""Text of Kratos' mesh files: blocks of numbered rows, and named parts of them. Numbers begin with 1."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array

PROPERTIES = ["Begin Properties 0", "End Properties", "Begin Properties 1", "End Properties"]


def nodes(points: Array) -> list[str]:
    """Block of nodes with three coordinates each."""
    return ["Begin Nodes", *(f"{i + 1} {row(x)}" for i, x in enumerate(points)), "End Nodes"]


def block(kind: str, connected: NDArray[np.int64]) -> list[str]:
    """Block of elements or conditions of one kind by the numbers of their nodes from 0 on; with properties 1."""
    lines = (f"{i + 1} 1 {row(found + 1)}" for i, found in enumerate(connected))
    return [f"Begin {kind}", *lines, f"End {kind.split()[0]}"]


def part(name: str, of_nodes: Iterable[int], cells: Iterable[int] = (), facets: Iterable[int] = ()) -> list[str]:
    """A named set of nodes, elements and conditions, by their numbers from 0 on."""
    lines = [f"Begin SubModelPart {name}"]
    for kind, numbers in (("Nodes", of_nodes), ("Elements", cells), ("Conditions", facets)):
        lines += [f"Begin SubModelPart{kind}", *(str(n + 1) for n in numbers), f"End SubModelPart{kind}"]
    return [*lines, "End SubModelPart"]


def row(values: Any, between: str = " ") -> str:
    return between.join(repr(value) for value in values.tolist())
