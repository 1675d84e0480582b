"""Section `coupling`: how the fluid and the elastic bodies in it are solved together."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import model_validator

from fsci.case.section import Section, fault, setting
from fsci.case.values import Count, CountOrZero, EntryCount, Name, NotNegative, NumberVector, Positive, Surfaces

PARTITIONED = ("accelerator", "relaxation", "reuse", "tolerance", "tolerance_absolute", "max_iterations")


class Coupling(Section):
    """Fluid and structure at once (monolithic), or one after the other until they agree (partitioned)."""

    scheme: Literal["monolithic", "partitioned"] = setting(
        "monolithic", "monolithic: one Newton iteration for all; partitioned: Dirichlet-Neumann iterations"
    )
    wetted: dict[Name, Surfaces] = setting(
        dict,
        "surfaces that the fluid touches, by body; default: all but what lies in other bodies or, without contact, "
        "on the boundary of the box at the start",
    )
    dry_side: dict[Name, Annotated[tuple[NumberVector, ...], EntryCount(1, None)]] = setting(
        dict,
        "2D: corners of a way around the box, from one end of the wetted surface of a body to its other end; between "
        "both there is no fluid, wherever the surface moves: for walls and membranes with fluid on one side",
        unit="m",
    )
    accelerator: Literal["iqn", "aitken", "constant"] = setting(
        "iqn", "partitioned: interface quasi-Newton, Aitken's relaxation, or a constant one"
    )
    relaxation: Positive = setting(0.5, "partitioned: relaxation factor of the first iteration", unit="1")
    reuse: CountOrZero = setting(8, "partitioned, iqn: number of earlier steps whose iterations are reused")
    tolerance: Positive = setting(
        1e-6, "partitioned: tolerance of the interface residual, relative to the displacement of the step", unit="1"
    )
    tolerance_absolute: NotNegative = setting(
        0.0, "partitioned: absolute tolerance of the interface residual", unit="m"
    )
    max_iterations: Count = setting(50, "partitioned: iterations after which a step has failed")

    @model_validator(mode="after")
    def _for_partitioned(self) -> Coupling:
        for name in PARTITIONED:
            if self.scheme == "monolithic" and name in self.model_fields_set:
                raise fault(f"'{name}' is for the partitioned scheme", name)
        return self
