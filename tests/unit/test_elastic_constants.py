"""Elastic constants from one another, and those that the case file's materials have at small strains."""

import numpy as np
import pytest
import ufl
from pydantic import TypeAdapter

from fsci.builder.named import named
from fsci.case.material import LAWS, ElasticSection, Material
from solvers.structure import elastic_constants as constants
from solvers.structure import materials
from solvers.structure.materials import parameters

E, NU = 210.0, 0.3
MU, LAMBDA = E / 2.6, E * NU / 1.3 / 0.4


def test_constants_from_one_another():
    assert constants.lame(E, NU) == pytest.approx((MU, LAMBDA), rel=1e-15)
    assert constants.shear(E, NU) == pytest.approx(MU, rel=1e-15)
    assert constants.lambda_of_poisson(MU, NU) == pytest.approx(LAMBDA, rel=1e-14)
    assert constants.lambda_of_bulk(MU, LAMBDA + 2 / 3 * MU) == pytest.approx(LAMBDA, rel=1e-14)
    assert constants.young(MU, LAMBDA) == pytest.approx(E, rel=1e-14)
    assert constants.poisson(MU, LAMBDA) == pytest.approx(NU, rel=1e-14)


@pytest.mark.parametrize(
    "given", [{"E": E, "nu": NU}, {"lambda": LAMBDA, "mu": MU}, {"mu": MU, "nu": NU}], ids=lambda g: "_".join(g)
)
def test_two_constants_give_the_others(given):
    assert ElasticSection(law="neo_hooke", **given).lame == pytest.approx((MU, LAMBDA), rel=1e-14)


def test_constants_may_vary_in_space():
    mu, lmbda = ElasticSection(law="neo_hooke", E="210*(1 + x)", nu=NU).lame
    x = np.array([[0.0, 1.0], [0.0, 0.0]])
    assert mu(x, 0.0) == pytest.approx([MU, 2 * MU])
    assert lmbda(x, 0.0) == pytest.approx([LAMBDA, 2 * LAMBDA])


@pytest.mark.parametrize("law", LAWS)
def test_constants_are_those_of_the_law(law):
    """Energy of a small strain e against mu e:e + lambda/2 (tr e)^2, for the constants that the case says it has."""
    others = {
        "mooney_rivlin": {"c10": 20.0, "c01": 10.0, "bulk": 120.0},
        "yeoh": {"c10": 30.0, "c20": 5.0, "bulk": 120.0},
        "ogden": {"terms": [{"mu": 40.0, "alpha": 2.5}, {"mu": -10.0, "alpha": -2.0}], "bulk": 120.0},
        "holzapfel_gasser_ogden": {"mu": 60.0, "k1": 0.0, "k2": 1.0, "fibres": [[1, 2, 3]], "bulk": 120.0},
    }
    settings = TypeAdapter(Material).validate_python({"law": law, **others.get(law, {"E": E, "nu": NU})})
    material = named(materials, law)(*settings.parameters, 0.0)
    mu, lmbda = settings.lame
    for strain in (np.diag([1.0, 0.0, 0.0]), np.diag([1.0, 1.0, 1.0]), np.array([[0, 1, 0], [1, 0, 0], [0, 0, 0.0]])):
        energy = energy_of(material, np.eye(3) + 1e-3 * strain)
        expected = 1e-6 * (mu * np.sum(strain**2) + lmbda / 2 * np.trace(strain) ** 2)
        assert energy == pytest.approx(expected, rel=1e-2)


def energy_of(material, F):
    """W(F) by evaluating the UFL expression."""
    values = {name: ufl.as_ufl(float(value)) for name, value in parameters(material).items()}
    rest = material.energy(ufl.as_matrix(np.eye(3).tolist()), **values)
    return float(material.energy(ufl.as_matrix(F.tolist()), **values)(())) - float(rest(()))
