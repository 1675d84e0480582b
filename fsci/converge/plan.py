"""The runs that the error of a case is estimated from, and what they cost."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from fsci.case import Case, CaseError
from fsci.check.cost import costs, estimate
from fsci.converge.ladder import SOURCE_WORDS, Source, fixed, scalable, scaled, sources
from fsci.meshes.of_case import read_body
from fsci.twin.changes import Twin, twins
from fsci.twin.grids import Settings, low_discrepancy, shifted

Role = Literal["level", "source", "twin", "shift"]

ROOT = math.sqrt(2.0)
COARSER = (ROOT, 2.0)
FINER = (1.0 / ROOT, 0.5, 0.5 / ROOT, 0.25)
FILE_SIZES = (2.0, 4.0)  #: of mesh files
SHIFTED_RUNS = 3
SECONDS_TO_START = 1.1  #: until a process has imported all; each run is a copy of one
SECONDS_OF_A_COPY = 0.2  #: start and end of a run
#: Schemes of the flow -> those with half of their error or less; the spectral radius of bodies from which on the error
#: is that of its limit 1.
BETTER_SCHEMES = {"backward_euler": "bdf2", "bdf2": "bdf2_optimized"}
LEAST_DAMPED = 0.9


@dataclass(frozen=True)
class PlannedRun:
    """A run of the case with some settings changed."""

    twin: Twin
    role: Role
    ratios: Mapping[str, float] = field(default_factory=dict)  #: real sizes of sources over those of the case
    seconds: float = math.nan  #: estimated

    @property
    def name(self) -> str:
        return self.twin.name

    @property
    def size(self) -> float:
        """Mean ratio of all sources that it changes."""
        changed = [ratio for ratio in self.ratios.values() if ratio != 1.0]
        return math.prod(changed) ** (1.0 / len(changed)) if changed else 1.0


@dataclass(frozen=True)
class Refused:
    """A run that is no case."""

    run: PlannedRun
    error: CaseError

    @property
    def message(self) -> str:
        """The first problem, without its place: that is one of the case itself."""
        return self.error.problems[0].message


class Plan:
    """The runs of a case, each made when it is asked for."""

    def __init__(self, case: Case, load: Callable[[Settings], Case]):
        """`load` reads the case with further settings. Raises CaseError for meshes that cannot be read."""
        self.case, self._load = case, load
        self._coarser: list[PlannedRun | Refused] | None = None
        self.sources: dict[str, Source] = sources(case)
        self.fixed = list(fixed(case))  #: bodies from mesh files, the facets of whose curved surfaces stay
        meshes = {name: read_body(case, name) for name in case.elastic_bodies}
        self.dimension = next((mesh.points.shape[1] for mesh in meshes.values()), case.dimension or 2)
        self._unknowns = {"bodies": 0, "files": 0}
        for name, mesh in meshes.items():
            self._unknowns["bodies" if scalable(case.elastic_bodies[name].mesh) else "files"] += mesh.points.size

    def base(self) -> PlannedRun:
        """The case itself."""
        return PlannedRun(Twin("case", "the case itself", "space"), "level", {}, self._cost(self.case, {}))

    def coarser(self) -> list[PlannedRun | Refused]:
        """The levels below the case; fewer where its counts are too small for two."""
        if self._coarser is None:
            self._coarser = self._levels(FILE_SIZES if self._only_files else COARSER)
        return self._coarser

    def in_place_of_coarser(self) -> list[PlannedRun | Refused]:
        """Finer levels of mesh files, which have no coarser ones; in 3D only one, for its cost."""
        wanted = 2 - len(self.coarser()) if self._only_files else 0
        return self._levels([1.0 / factor for factor in FILE_SIZES[: min(wanted, 4 - self.dimension)]])

    @property
    def _only_files(self) -> bool:
        """Nothing has a size but cells of mesh files."""
        return list(self.sources) == ["files"]

    def finer(self) -> list[PlannedRun | Refused]:
        """The levels above the case."""
        return self._levels(FINER)

    def alone(self) -> Iterator[PlannedRun | Refused]:
        """Each source alone, with twice the size, or half of it where there is no larger one."""
        for name, source in self.sources.items() if len(self.sources) > 1 else ():
            factor, words = (2.0, "twice") if source.largest >= 2.0 else (0.5, "half")
            made = self._scaled(
                f"{name}_{factor:g}", f"{SOURCE_WORDS[name]} alone {words} as large", {name: factor}, "source"
            )
            if isinstance(made, Refused) or abs(math.log(made.size)) > 0.1:
                yield made

    def settings(self, factors: Mapping[str, float], further: Settings) -> Settings:
        """Settings with each source so many times as large as in the case with further settings."""
        return scaled(sources(self._load(further)), factors)

    def unchanged(self, runs: Iterable[PlannedRun]) -> list[str]:
        """Sources that none of the runs makes larger or smaller."""
        changed = {name for run in runs for name, ratio in run.ratios.items() if ratio != 1.0}
        return [SOURCE_WORDS[name] for name in self.sources if name not in changed]

    def twins(self) -> Iterator[PlannedRun | Refused]:
        """Better elements of the flow and of bodies, and a better time scheme: what they change is the error."""
        found = {twin.name: twin for twin in twins(self.case)}
        if "coarse" in found:
            yield self._of_twin(found["coarse"], "element")
        if "order" in found:
            yield self._order(found["order"])
        if changes := _better_scheme(self.case):
            words = ", ".join(f"{name.rsplit('.', 1)[-1]} {value}" for name, value in changes)
            yield self._of_twin(Twin("scheme", words, "time", changes), "scheme")

    def element_in_the_same_cells(self) -> PlannedRun | Refused | None:
        """In place of `element`, where its cells are too large."""
        found = {twin.name: twin for twin in twins(self.case)}
        return self._of_twin(found["element"], "element") if "coarse" in found else None

    def shifts(self) -> Iterator[PlannedRun | Refused]:
        """The first coarser level with the planes of its grid moved, for values that depend on where cells lie."""
        fluid = self.case.fluid
        points = any(probe.at is not None for probe in self.case.probes.values())
        if fluid is None or not (fluid.bodies or self.case.elastic_bodies or points):
            return
        level, *_ = [*self.coarser(), self.base()]
        if isinstance(level, Refused):
            return
        other = self._load(level.twin.settings).fluid
        assert other is not None
        for number, shares in enumerate(low_discrepancy(other.grid.dimension, SHIFTED_RUNS), 1):
            words = f"{level.twin.words}, planes moved by {', '.join(f'{share:+.2f}' for share in shares)} cells"
            settings = (*level.twin.settings, *shifted(other.grid, shares.tolist()))
            yield PlannedRun(Twin(f"shift_{number}", words, "scatter", settings), "shift", level.ratios, level.seconds)

    def _levels(self, factors: Sequence[float]) -> list[PlannedRun | Refused]:
        made: list[PlannedRun | Refused] = []
        for factor in factors:
            what = ", ".join(SOURCE_WORDS[name] for name, source in self.sources.items() if source.settings(factor))
            name = f"coarser_{factor:.3g}" if factor > 1.0 else f"finer_{1.0 / factor:.3g}"
            ratio = f"{factor:.3g} times as large" if factor > 1.0 else f"{1.0 / factor:.3g} times as fine"
            run = self._scaled(name, f"{what} {ratio}", dict.fromkeys(self.sources, factor), "level")
            sizes = [1.0, *(other.size for other in made if isinstance(other, PlannedRun))]
            # counts that are too small to differ make no level of their own
            if isinstance(run, Refused) or all(abs(math.log(run.size / size)) > 0.1 for size in sizes):
                made.append(run)
        return made

    def _scaled(self, name: str, words: str, factors: Mapping[str, float], role: Role) -> PlannedRun | Refused:
        settings = scaled(self.sources, factors)
        run = PlannedRun(Twin(name, words, "space", settings), role, dict(factors))
        try:
            other = self._load(settings)
            ratios = {name: self.sources[name].ratio(self.case, other) for name in factors}
            return PlannedRun(run.twin, role, ratios, self._cost(other, ratios))
        except CaseError as error:
            return Refused(run, error)

    def _of_twin(self, twin: Twin, name: str) -> PlannedRun | Refused:
        run = PlannedRun(Twin(name, twin.words, twin.meaning, twin.settings), "twin")
        try:
            return PlannedRun(run.twin, "twin", {}, self._cost(self._load(twin.settings), {}))
        except CaseError as error:
            return Refused(run, error)

    def _order(self, twin: Twin) -> PlannedRun | Refused:
        """In 3D with cells twice as large: in the same ones it costs eight times as much, or more."""
        settings, words, ratio = twin.settings, twin.words, 1.0
        if self.dimension == 3 and "bodies" in self.sources:
            settings, ratio = (*settings, *scaled(self.sources, {"bodies": 2.0})), 2.0
            words = f"{words} with cells twice as large"
        run = PlannedRun(Twin("order", words, "space", settings), "twin")
        try:
            return PlannedRun(run.twin, "twin", {}, self._cost(self._load(settings), {"bodies": 0.5 * ratio}))
        except CaseError as error:
            return Refused(run, error)

    def _cost(self, other: Case, ratios: Mapping[str, float]) -> float:
        """Seconds on one process, by the ratios of the sizes of cells of bodies: of them no mesh is read."""
        unknowns = (count * ratios.get(name, 1.0) ** -self.dimension for name, count in self._unknowns.items())
        structure = None if self.case.structure is None else round(sum(unknowns))
        found = estimate(other, structure, costs(), self.dimension)
        return SECONDS_OF_A_COPY + (0.0 if found is None else found.step * other.time.steps)


def _better_scheme(case: Case) -> Settings:
    """Time schemes with less error than those of the case; empty if there are none."""
    changes: list[tuple[str, str]] = []
    if case.fluid is not None and case.fluid.scheme in BETTER_SCHEMES:
        changes.append(("fluid.scheme", BETTER_SCHEMES[case.fluid.scheme]))
    dynamics = None if case.structure is None else case.structure.dynamics
    if dynamics is not None and dynamics.rho_inf is not None and dynamics.rho_inf < LEAST_DAMPED:
        changes.append(("structure.dynamics.rho_inf", str(LEAST_DAMPED)))
    return tuple(changes)
