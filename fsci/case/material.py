"""Section `material` of a body."""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, WithJsonSchema, model_validator

from fsci.case.section import Section, fault, setting
from fsci.case.values import (
    Dispersion,
    EntryCount,
    Name,
    NotNegativeFormula,
    Number,
    PoissonFormula,
    Positive,
    PositiveFormula,
    SpaceFormula,
    SpaceVector,
    chosen,
    describe_value,
    value_of,
)
from fsci.distinct import distinct
from fsci.expression import Expression
from solvers.structure import elastic_constants as constants
from solvers.values import Value, combine

DENSITY = "mass per reference volume; default: 0, enough for statics without gravity and without probes of mass"
PAIRS = ({"E", "nu"}, {"lambda", "mu"}, {"mu", "nu"})


def _values(*settings: Expression | None) -> list[Value]:
    """Mistakes in the given settings."""
    return [value_of(setting) for setting in settings if setting is not None]


def _or_zero(setting: Expression | None) -> Value:
    return 0.0 if setting is None else value_of(setting)


class RelaxingSection(Section):
    """A part of the stress that relaxes: of the distortional stress at once, `share` decays with exp(-t/time)."""

    share: Positive = setting(..., "share of the stress at once, as g_i of a Prony series", unit="1")
    time: Positive = setting(..., "time in which it falls to 37 %", unit="s")


def _some_remains(parts: tuple[RelaxingSection, ...]) -> tuple[RelaxingSection, ...]:
    total = sum(part.share for part in parts)
    if total >= 1:
        raise fault(f"the sum of all 'share' in 'viscous' must be less than 1, not {total:g}")
    return parts


Viscous = Annotated[tuple[RelaxingSection, ...], AfterValidator(_some_remains)]
VISCOUS = "stresses that relax (Prony series); the constants of the law are those after a long time; default: none"


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
    viscous: Viscous = setting(tuple, VISCOUS)

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
    viscous: Viscous = setting(tuple, VISCOUS)

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


class YeohSection(Section):
    """W = c10 (I - 3) + c20 (I - 3)^2 + c30 (I - 3)^3 + bulk/2 (J - 1)^2, I = J^(-2/3) I1; for rubber.

    The shear modulus is 2 c10.
    """

    law: Literal["yeoh"] = setting(..., "stored energy")
    c10: PositiveFormula = setting(..., "factor of I - 3", unit="Pa")
    c20: SpaceFormula | None = setting(None, "factor of (I - 3)^2; default: 0", unit="Pa")
    c30: SpaceFormula | None = setting(None, "factor of (I - 3)^3; default: 0", unit="Pa")
    bulk: PositiveFormula = setting(..., "bulk modulus", unit="Pa")
    density: NotNegativeFormula | None = setting(None, DENSITY, unit="kg/m^3")
    viscous: Viscous = setting(tuple, VISCOUS)

    @property
    def lame(self) -> tuple[Value, Value]:
        """(mu, lambda) at small strains."""
        mu = combine(lambda c10: 2 * c10, value_of(self.c10))
        return mu, combine(constants.lambda_of_bulk, mu, value_of(self.bulk))

    @property
    def parameters(self) -> tuple[Value, ...]:
        """The arguments of the law before the density."""
        return value_of(self.c10), _or_zero(self.c20), _or_zero(self.c30), value_of(self.bulk)


class OgdenTermSection(Section):
    """A term of Ogden's law."""

    mu: SpaceFormula = setting(..., "factor mu_p; its sign is that of alpha", unit="Pa")
    alpha: Number = setting(..., "exponent alpha_p of the principal stretches", unit="1")

    @model_validator(mode="after")
    def _stiff(self) -> OgdenTermSection:
        if self.alpha == 0:
            raise fault("must not be 0", "alpha")
        if self.mu.constant is not None and self.mu.constant * self.alpha <= 0:
            raise fault(f"must have the sign of alpha = {self.alpha:g}, or the law is unstable", "mu")
        return self


class OgdenSection(Section):
    """W = sum of mu_p/alpha_p (m1^alpha_p + m2^alpha_p + m3^alpha_p - 3) + bulk/2 (J - 1)^2; for rubber.

    m1, m2 and m3 are the principal stretches times J^(-1/3). The shear modulus is half of the sum of mu_p alpha_p.
    """

    law: Literal["ogden"] = setting(..., "stored energy")
    terms: Annotated[tuple[OgdenTermSection, ...], EntryCount(1, None)] = setting(..., "mu_p and alpha_p of each term")
    bulk: PositiveFormula = setting(..., "bulk modulus", unit="Pa")
    density: NotNegativeFormula | None = setting(None, DENSITY, unit="kg/m^3")
    viscous: Viscous = setting(tuple, VISCOUS)

    @property
    def lame(self) -> tuple[Value, Value]:
        """(mu, lambda) at small strains."""
        moduli = (combine(lambda mu, alpha=term.alpha: mu * alpha / 2, value_of(term.mu)) for term in self.terms)
        mu = combine(lambda *parts: sum(parts), *moduli)
        return mu, combine(constants.lambda_of_bulk, mu, value_of(self.bulk))

    @property
    def parameters(self) -> tuple[Any, ...]:
        """The arguments of the law before the density."""
        return tuple((value_of(term.mu), term.alpha) for term in self.terms), value_of(self.bulk)


class HolzapfelGasserOgdenSection(Section):
    """A matrix with one or two families of fibres that carry tension only, for arteries and other soft tissue.

    W = mu/2 (I - 3) + sum of k1/(2 k2) (exp(k2 E^2) - 1) where E > 0, + bulk/2 (J - 1)^2; I = J^(-2/3) I1 and
    E = dispersion (I - 3) + (1 - 3 dispersion) (J^(-2/3) a.C a - 1) for the direction a of a family.
    """

    law: Literal["holzapfel_gasser_ogden"] = setting(..., "stored energy")
    mu: PositiveFormula = setting(..., "shear modulus of the matrix", unit="Pa")
    k1: NotNegativeFormula = setting(..., "stiffness of a family of fibres", unit="Pa")
    k2: PositiveFormula = setting(..., "how fast fibres stiffen", unit="1")
    dispersion: Dispersion | None = setting(None, "spread of the directions of a family; default: 0, none", unit="1")
    fibres: Annotated[tuple[SpaceVector, ...], EntryCount(1, 2)] = setting(
        ..., "direction of each family in the undeformed body, of any length"
    )
    bulk: PositiveFormula = setting(..., "bulk modulus", unit="Pa")
    density: NotNegativeFormula | None = setting(None, DENSITY, unit="kg/m^3")
    viscous: Viscous = setting(tuple, VISCOUS)

    @model_validator(mode="after")
    def _directions(self) -> HolzapfelGasserOgdenSection:
        for direction in self.fibres:
            if all(entry.constant == 0.0 for entry in direction):
                raise fault("a direction in 'fibres' must not be zero", "fibres")
        return self

    @property
    def lame(self) -> tuple[Value, Value]:
        """(mu, lambda) at small strains, of the matrix."""
        mu = value_of(self.mu)
        return mu, combine(constants.lambda_of_bulk, mu, value_of(self.bulk))

    @property
    def parameters(self) -> tuple[Value, ...]:
        """The arguments of the law before the density; one family is two alike with half of the stiffness."""
        k1 = combine(lambda k1: k1 * len(self.fibres) / 2, value_of(self.k1))
        first, *others = ([*map(value_of, direction), 0.0][:3] for direction in self.fibres)
        return (
            *(value_of(self.mu), k1, value_of(self.k2), _or_zero(self.dispersion), value_of(self.bulk)),
            *first,
            *(others[0] if others else first),
        )


def _own_law(value: Any) -> Any:
    if not isinstance(value, str) or not re.fullmatch(r".+\.py:[A-Za-z_]\w*", value):
        raise fault(f"must be FILE.py:NAME, not {describe_value(value)}")
    return value


class OwnLawSection(Section):
    """An energy of one's own: `law: FILE.py:NAME` is a function NAME(F, parameters by name) in a Python file.

    It returns the stored energy per reference volume [J/m^3] as an expression of UFL; F is the deformation gradient,
    3x3 in plane strain, too. The commands that run its code need the option `--trust`.
    """

    law: Annotated[
        str,
        BeforeValidator(_own_law),
        WithJsonSchema({"type": "string", "pattern": r"\.py:", "$comment": "FILE.py:NAME"}),
    ] = setting(..., "file, relative to the case file, and name of the function")
    parameters: dict[Name, SpaceFormula] = setting(dict, "values of the function's parameters")
    density: NotNegativeFormula | None = setting(None, DENSITY, unit="kg/m^3")
    viscous: Viscous = setting(tuple, VISCOUS)

    @property
    def file(self) -> str:
        """Path of the file, relative to the case file."""
        return self.law.rpartition(":")[0]

    @property
    def function(self) -> str:
        """Name of the function."""
        return self.law.rpartition(":")[2]

    @property
    def values(self) -> dict[str, Value]:
        """The parameters by name."""
        return {name: value_of(value) for name, value in self.parameters.items()}


def has_mass(material: MaterialSection) -> bool:
    """Whether it has a density that is not zero everywhere."""
    return material.density is not None and material.density.constant != 0.0


LAWS = (
    *("st_venant_kirchhoff", "neo_hooke", "coup_neo_hooke", "mooney_rivlin", "yeoh", "ogden"),
    "holzapfel_gasser_ogden",
)
LawSection: TypeAlias = ElasticSection | MooneyRivlinSection | YeohSection | OgdenSection | HolzapfelGasserOgdenSection
MaterialSection: TypeAlias = LawSection | OwnLawSection


def _is_own(value: Any) -> bool:
    return isinstance(value, dict) and isinstance(value.get("law"), str) and ".py" in value["law"]


# The tags are no names of settings, so that an error's path cannot be misread.
Material = Annotated[
    Annotated[LawSection, Field(discriminator="law"), chosen("law", LAWS, "FILE.py:NAME"), Tag("law of the program")]
    | Annotated[OwnLawSection, Tag("own law")],
    Discriminator(lambda value: "own law" if _is_own(value) else "law of the program"),
]

#: Section -> an example of it.
MATERIAL_EXAMPLES = {
    "Elastic": "material: {law: neo_hooke, E: 4000, nu: 0.4, density: 1000}",
    "MooneyRivlin": "material: {law: mooney_rivlin, c10: 3e5, c01: 1e5, bulk: 5e8, density: 1100}",
    "Yeoh": "material: {law: yeoh, c10: 2e5, c20: -4e3, c30: 300, bulk: 1e8, density: 1100}",
    "Ogden": (
        "material: {law: ogden, terms: [{mu: 6.3e5, alpha: 1.3}, {mu: 1.2e3, alpha: 5}, {mu: -1e4, alpha: -2}],\n"
        "           bulk: 1e9}"
    ),
    "OgdenTerm": "terms: [{mu: 6.3e5, alpha: 1.3}, {mu: -1e4, alpha: -2}]",
    "HolzapfelGasserOgden": (
        "material: {law: holzapfel_gasser_ogden, mu: 7.6e3, k1: 9.966e5, k2: 524.6, dispersion: 0.226,\n"
        "           fibres: [[1, 0, 0.85], [1, 0, -0.85]], bulk: 1e6, density: 1100}"
    ),
    "Relaxing": "viscous: [{share: 0.4, time: 0.02}, {share: 0.1, time: 3}]",
    "OwnLaw": "material: {law: gent.py:Gent, parameters: {mu: 4e5, limit: 30, bulk: 1e8}, density: 1100}",
}
