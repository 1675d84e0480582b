"""Section `material` of a body."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from fsci.case.section import Section, fault, setting
from fsci.case.values import NotNegativeFormula, PoissonFormula, PositiveFormula, SpaceFormula, chosen, value_of
from fsci.distinct import distinct
from fsci.expression import Expression
from solvers.structure import elastic_constants as constants
from solvers.values import Value, combine

DENSITY = "mass per reference volume; default: 0, enough for statics without gravity and without probes of mass"
PAIRS = ({"E", "nu"}, {"lambda", "mu"}, {"mu", "nu"})


def _values(*settings: Expression | None) -> list[Value]:
    """Mistakes in the given settings."""
    return [value_of(setting) for setting in settings if setting is not None]


class ElasticSection(Section):
    """A hyperelastic law with two constants: exactly E and nu, or lambda and mu, or mu and nu.

    - st_venant_kirchhoff: W = lambda/2 (tr E)^2 + mu E:E with the Green-Lagrange strain E; for small strains.
    - neo_hooke: W = mu/2 (I1 - 3) - mu ln J + lambda/2 (ln J)^2.
    - coup_neo_hooke: W = c/beta (J^(-2 beta) - 1) + c (I1 - 3), c = mu/2, beta = nu/(1 - 2 nu), nu at least 0.
    """

    law: Literal["st_venant_kirchhoff", "neo_hooke", "coup_neo_hooke"] = setting(..., "stored energy")
    E: PositiveFormula | None = setting(None, "Young's modulus", unit="Pa")
    nu: PoissonFormula | None = setting(None, "Poisson's ratio", unit="1")
    lmbda: SpaceFormula | None = setting(None, "first Lame constant", unit="Pa", name="lambda")
    mu: PositiveFormula | None = setting(None, "second Lame constant, the shear modulus", unit="Pa")
    density: NotNegativeFormula | None = setting(None, DENSITY, unit="kg/m^3")

    @model_validator(mode="after")
    def _two_constants(self) -> ElasticSection:
        settings = {"E": self.E, "nu": self.nu, "lambda": self.lmbda, "mu": self.mu}
        given = [name for name, value in settings.items() if value is not None]
        if set(given) not in PAIRS:
            raise fault(
                f"law '{self.law}' needs two constants, either E and nu, or lambda and mu, or mu and nu; "
                f"given: {', '.join(given) or 'none'}"
            )
        if self.lmbda is not None and self.mu is not None:
            lmbda, mu = self.lmbda.constant, self.mu.constant
            if lmbda is not None and mu is not None and lmbda <= -2 * mu / 3:
                words = "must be greater than -2/3 mu, {}, not {}".format(*distinct(-2 * mu / 3, lmbda))
                raise fault(words, "lambda")
        for name in ("nu", "lambda"):
            value = settings[name]
            if self.law == "coup_neo_hooke" and value and value.constant is not None and value.constant < 0:
                raise fault("must be at least 0 for the law 'coup_neo_hooke'", name)
        return self

    @property
    def lame(self) -> tuple[Value, Value]:
        """(mu, lambda)."""
        [mu] = _values(self.mu) or [combine(constants.shear, *_values(self.E, self.nu))]
        [lmbda] = _values(self.lmbda) or [combine(constants.lambda_of_poisson, mu, *_values(self.nu))]
        return mu, lmbda

    @property
    def parameters(self) -> tuple[Value, ...]:
        """The arguments of the law before the density."""
        return self.lame


class MooneyRivlinSection(Section):
    """W = c10 (J^(-2/3) I1 - 3) + c01 (J^(-4/3) I2 - 3) + bulk/2 (J - 1)^2; the shear modulus is 2 (c10 + c01)."""

    law: Literal["mooney_rivlin"] = setting(..., "stored energy")
    c10: SpaceFormula = setting(..., "factor of the first invariant", unit="Pa")
    c01: SpaceFormula = setting(..., "factor of the second invariant", unit="Pa")
    bulk: PositiveFormula = setting(..., "bulk modulus", unit="Pa")
    density: NotNegativeFormula | None = setting(None, DENSITY, unit="kg/m^3")

    @model_validator(mode="after")
    def _stiff(self) -> MooneyRivlinSection:
        c10, c01 = self.c10.constant, self.c01.constant
        if c10 is not None and c01 is not None and c10 + c01 <= 0:
            raise fault(f"the sum of c10 and c01 must be greater than 0, not {c10 + c01:g}", "c10")
        return self

    @property
    def lame(self) -> tuple[Value, Value]:
        """(mu, lambda) at small strains."""
        c10, c01, bulk = self.parameters
        mu = combine(lambda c10, c01: 2 * (c10 + c01), c10, c01)
        return mu, combine(constants.lambda_of_bulk, mu, bulk)

    @property
    def parameters(self) -> tuple[Value, ...]:
        """The arguments of the law before the density."""
        return value_of(self.c10), value_of(self.c01), value_of(self.bulk)


def has_mass(material: ElasticSection | MooneyRivlinSection) -> bool:
    """Whether it has a density that is not zero everywhere."""
    return material.density is not None and material.density.constant != 0.0


LAWS = ("st_venant_kirchhoff", "neo_hooke", "coup_neo_hooke", "mooney_rivlin")
Material = Annotated[ElasticSection | MooneyRivlinSection, Field(discriminator="law"), chosen("law", LAWS)]

#: Section -> an example of it.
MATERIAL_EXAMPLES = {
    "Elastic": "material: {law: neo_hooke, E: 4000, nu: 0.4, density: 1000}",
    "MooneyRivlin": "material: {law: mooney_rivlin, c10: 3e5, c01: 1e5, bulk: 5e8, density: 1100}",
}
