"""Scenes of random cases: entries of scenes.yaml, whose parameters are drawn and whose cases have formulas of them."""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from fsci.stress.frame import Frame
from fsci.template import fill, value_of

SCENES = Path(__file__).with_name("scenes.yaml")
ENTRIES = ("words", "from", "any_angle", "beside", "parameters", "case", "must_warn")

Case = dict[str, Any]


class SceneError(ValueError):
    """An entry that is no scene."""


@dataclass(frozen=True)
class StressScene:
    """One draw of a scene."""

    name: str
    parameters: Mapping[str, Any]
    content: Mapping[str, Any]  #: the case with formulas, in its own frame
    any_angle: bool = False  #: no grid: it may be turned by any angle
    must_warn: tuple[str, ...] = field(default=())  #: texts that the output of a successful run must contain
    body_beside: Mapping[str, Any] | None = None  #: a body of the stiffness `beside` that nothing touches
    by: float = 0.0  #: shift of the body along every axis of the grid [m]

    @property
    def probes(self) -> Mapping[str, Any]:
        """Their settings."""
        return self.content.get("probes", {})

    @property
    def dim(self) -> int:
        """2 or 3: the length of the first point or vector of the case."""
        return 3 if _in_space(self.content) else 2

    def case(self, frame: Frame) -> Case:
        """The case in a frame."""
        return frame.case(fill(self.content, {**self.parameters, "by": self.by}))

    def beside(self, frame: Frame, stiffness: float) -> Case:
        """The body beside it in a frame."""
        bodies = {"structure": {"bodies": {"beside": fill(self.body_beside, {"beside": stiffness})}}}
        return frame.case(bodies)["structure"]["bodies"]["beside"]


def _in_space(content: Any) -> bool:
    if isinstance(content, Mapping):
        return any(len(v) == 3 if k in ("size", "from") else _in_space(v) for k, v in content.items())
    return isinstance(content, list) and any(map(_in_space, content))


@cache
def read_scenes(path: Path = SCENES) -> dict[str, dict[str, Any]]:
    """The scenes of a file by name; names that begin with a dot are none. Raises SceneError, OSError."""
    from ruamel.yaml import YAML, YAMLError

    try:
        entries = YAML(typ="safe", pure=True).load(path.read_text())
    except YAMLError as error:
        raise SceneError(f"{path}: {error}") from None
    if not isinstance(entries, Mapping):
        raise SceneError(f"{path} has no scenes: write NAME: {{words: .., parameters: .., case: ..}}")
    scenes = {str(name): entry for name, entry in entries.items() if str(name)[0] != "."}
    for name, entry in scenes.items():
        if not isinstance(entry, Mapping) or not {"words", "parameters", "case"} <= entry.keys():
            raise SceneError(f"{path}: scene '{name}' needs 'words', 'parameters' and 'case'")
        for key in entry.keys() - set(ENTRIES):
            raise SceneError(f"{path}: scene '{name}' has an unknown entry '{key}' (known: {', '.join(ENTRIES)})")
    return scenes


def series(seed: int, path: Path = SCENES) -> dict[str, dict[str, Any]]:
    """The scenes that a number is drawn from: those with the largest `from` that it reaches."""
    scenes = read_scenes(path)
    first = max((entry.get("from", 0) for entry in scenes.values() if entry.get("from", 0) <= seed), default=0)
    found = {name: entry for name, entry in scenes.items() if entry.get("from", 0) == first}
    if not found:
        least = min(entry["from"] for entry in scenes.values())
        raise SceneError(f"{path}: no scene is drawn from number {seed}; the first one has {least}: --seed {least}")
    return found


def draw_scene(name: str, entry: Mapping[str, Any], chance: random.Random) -> StressScene:
    """Draw the parameters of a scene."""
    parameters: dict[str, Any] = {}
    parts = entry["parameters"]
    for part in _mappings(parts if isinstance(parts, list) else [parts]):
        for parameter, kind in part.items():
            if kind is None:
                parameters.pop(parameter, None)
            else:
                parameters[parameter] = _drawn(kind, parameters, chance)
    warn = entry.get("must_warn", {})
    must_warn = tuple(words for words, formula in warn.items() if value_of(str(formula), parameters))
    return StressScene(name, parameters, entry["case"], entry.get("any_angle", False), must_warn, entry.get("beside"))


def _mappings(parts: Sequence[Any]) -> Iterator[Mapping[str, Any]]:
    for part in parts:
        yield from _mappings(part) if isinstance(part, list) else [part]


def _drawn(kind: Any, parameters: Mapping[str, Any], chance: random.Random) -> Any:
    """A list is what is chosen from; `spread` are bounds of a log-uniform number; a text has formulas."""
    if isinstance(kind, list):
        return chance.choice(kind)
    if not isinstance(kind, Mapping):
        return fill(kind, parameters)
    if "when" in kind and not value_of(str(kind["when"]), parameters):
        return kind["else"]

    def one() -> Any:
        return spread(chance, *kind["spread"]) if "spread" in kind else chance.choice(kind["choice"])

    return [one() for _ in range(kind["times"])] if "times" in kind else one()


def spread(chance: random.Random, low: float, high: float) -> float:
    """A number with log-uniform distribution between two bounds, rounded to three digits."""
    return float(f"{low * (high / low) ** chance.random():.3g}")
