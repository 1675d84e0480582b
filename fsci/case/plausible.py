"""Warnings about a case that can be run: numbers that are probably mistakes."""

from __future__ import annotations

from collections.abc import Iterator

from fsci.case.case import Case
from fsci.case.jumps import jump_warnings
from fsci.case.material import MaterialSection, OwnLawSection
from fsci.case.plausible_flow import flow_warnings, in_si
from fsci.case.plausible_gravity import gravity_warnings
from fsci.case.shapes import ShapeSection
from fsci.case.yaml_text import Keys
from fsci.distinct import distinct
from solvers.structure.elastic_constants import young

SOLID_DENSITIES = (1e-2, 3e4)  #: [kg/m^3] from aerogel to osmium, with a margin
STIFFNESSES = (1.0, 2e12)  #: [Pa] Young's modulus from the softest gel to diamond, with a margin


def warnings(case: Case) -> Iterator[tuple[Keys, str]]:
    """Paths of settings with a warning about each."""
    span = case.time.end - case.time.start
    if case.time.step > span * (1 + 1e-12):
        step, whole = distinct(case.time.step, span)
        yield ("time", "step"), f"the step {step} is longer than the run, {whole}"
    for name, body in case.elastic_bodies.items():
        keys: Keys = ("structure", "bodies", name)
        yield from _material(case, body.material, (*keys, "material"))
        if isinstance(body.mesh, ShapeSection) and (ratio := body.mesh.plan.aspect) > 50:
            yield (*keys, "mesh", "cells"), f"the cells are {ratio:.0f} times longer than wide"
    yield from jump_warnings(case)
    if case.rigid is not None and case.contact is not None and case.contact.friction is not None:
        if case.contact.friction.bound is not None:
            yield (
                ("contact", "friction"),
                "free rigid bodies touch each other, bodies of given motion and walls without friction: "
                "a bound of tractions needs elastic surfaces; give a 'coefficient'",
            )
    if case.fluid is not None:
        yield from flow_warnings(case, case.fluid)
        yield from gravity_warnings(case, case.fluid)


def _material(case: Case, material: MaterialSection, keys: Keys) -> Iterator[tuple[Keys, str]]:
    units = case.units
    density = None if material.density is None else material.density.constant
    if density and not SOLID_DENSITIES[0] <= density * units.density <= SOLID_DENSITIES[1]:
        value = in_si(density, units.density, f"{units.mass}/{units.length}^3", "kg/m^3")
        yield (*keys, "density"), f"implausible density: {value}; check 'units'"
    constants = _constants(material)
    if constants is None:
        return
    # Rounded as it is printed: the conversion through Lame's constants has rounding errors.
    E = float(f"{young(*constants):.3g}")
    if not STIFFNESSES[0] <= float(f"{E * units.stress:.3g}") <= STIFFNESSES[1]:
        key = "E" if getattr(material, "E", None) is not None else "law"
        value = in_si(E, units.stress, f"{units.mass}/({units.length} {units.time}^2)", "Pa")
        yield (*keys, key), f"implausible stiffness: Young's modulus {value}; check 'units'"


def _constants(material: MaterialSection) -> tuple[float, float] | None:
    """(mu, lambda) at small strains, in the case's unit; None if they vary, or are in a file with code."""
    if isinstance(material, OwnLawSection):
        return None
    mu, lmbda = material.lame
    return None if callable(mu) or callable(lmbda) else (mu, lmbda)
