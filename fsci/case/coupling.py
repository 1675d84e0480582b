"""Section `coupling`: how the fluid and the elastic bodies in it are solved together."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import model_validator

from fsci.case.section import Section, fault, setting
from fsci.case.values import Count, CountOrZero, EntryCount, Name, NotNegative, NumberVector, Positive, Surfaces

PARTITIONED = ("accelerator", "relaxation", "reuse", "tolerance", "tolerance_absolute", "max_iterations")


class Coupling(Section):
    """Fluid and structure in one system (monolithic), or alternately until they agree (partitioned)."""

    scheme: Literal["monolithic", "partitioned"] = setting(
        "monolithic", "monolithic: one Newton iteration for all; partitioned: Dirichlet-Neumann iterations"
    )
    wetted: dict[Name, Surfaces] = setting(
        dict,
        "surfaces that the fluid touches, by body; default: all surfaces except those inside of other bodies; "
        "those on the boundary of the box are wet as soon as they leave it",
    )
    dry_side: dict[Name, Literal["outside"] | Annotated[tuple[NumberVector, ...], EntryCount(1, None)]] = setting(
        dict,
        "walls and membranes with fluid on one side: there is none 'outside' of a wetted surface that is closed, or "
        "in 3D ends on faces of the box like a tube. In 2D corners of a polygon outside of the box that leads from one "
        "end of a body's wetted surface to the other end; there is no fluid between surface and polygon",
        unit="m",
    )
    accelerator: Literal["iqn", "aitken", "constant"] = setting(
        "iqn", "partitioned: interface quasi-Newton (iqn), Aitken's relaxation, or constant relaxation"
    )
    relaxation: Positive = setting(0.5, "partitioned: relaxation factor of the first iteration", unit="1")
    reuse: CountOrZero = setting(8, "partitioned, iqn: number of earlier steps whose iterations are reused")
    tolerance: Positive = setting(
        1e-6, "partitioned: tolerance of the interface residual, relative to the displacement of the step", unit="1"
    )
    tolerance_absolute: NotNegative = setting(
        0.0, "partitioned: absolute tolerance of the interface residual", unit="m"
    )
    max_iterations: Count = setting(50, "partitioned: most iterations of a step; one that needs more has failed")

    @model_validator(mode="after")
    def _for_partitioned(self) -> Coupling:
        for name in PARTITIONED:
            if self.scheme == "monolithic" and name in self.model_fields_set:
                raise fault(f"'{name}' applies only to the partitioned scheme", name)
        return self
