"""The table of quantities against the probes that the fields have, and what a case may say of each."""

import importlib

import pytest

from fsci.case.probes import Probe
from fsci.case.quantities import FIELDS, LOCATIONS, QUANTITIES
from fsci.plot.units import label
from fsci.schema import reference_markdown

WHERE = {"at": [0.5, 0.5], "on": "left", "pair": "touch", "through": "outlet"}
WHERE["plane"] = {"point": [0.5, 0.5], "normal": [1, 0]}
WHERE["box"] = [[0.2, 0.3], [0.5, 0.5]]
UNITS = {"length": "mm", "mass": "t", "time": "s"}


def each_place():
    for quantity in QUANTITIES.values():
        for field in FIELDS:
            for place in quantity.locations(field):
                yield quantity.name, field, place


@pytest.mark.parametrize(("name", "field", "place"), list(each_place()))
def test_every_quantity_can_be_asked_for_where_it_is(name, field, place):
    where = {place: WHERE[place]} if place else {}
    reference = {"reference": {"velocity": 1.0, "length": 1.0}} if "reference" in QUANTITIES[name].needs else {}
    probe = Probe(quantity=name, **where, **reference)
    assert field in probe.fields


@pytest.mark.parametrize("field", FIELDS)
def test_a_builder_makes_each_quantity_where_it_is(field):
    table = getattr(importlib.import_module(f"fsci.builder.{field}"), f"{field.upper()}_PROBES")
    assert set(table) == {(name, place) for name, of, place in each_place() if of == field}


@pytest.mark.parametrize("name", QUANTITIES)
def test_no_quantity_can_be_asked_for_elsewhere(name):
    quantity = QUANTITIES[name]
    for place in (*LOCATIONS, ""):
        if not any(place in quantity.locations(field) for field in FIELDS):
            reference = {"reference": {"velocity": 1.0}} if "reference" in quantity.needs else {}
            with pytest.raises(ValueError, match=f"'{name}'"):
                Probe(quantity=name, **({place: WHERE[place]} if place else {}), **reference)


def test_columns():
    assert QUANTITIES["force"].columns("f", 3) == ("f.x", "f.y", "f.z")
    assert QUANTITIES["moment"].columns("m", 2) == ("m",)
    assert QUANTITIES["moment"].columns("m", 3) == ("m.x", "m.y", "m.z")
    assert QUANTITIES["energy"].columns("e", 2) == ("e.kinetic", "e.internal", "e.work", "e.total")
    assert QUANTITIES["gap"].columns("g", 3) == ("g",)


def test_units_of_labels():
    assert label("p", "pressure", UNITS) == "p [MPa]"
    assert label("q", "flow_rate", UNITS) == "q [mm$^3$/s]"
    assert label("c", "drag_coefficient", UNITS) == "c"
    assert label("t", "first_contact", UNITS) == "t [s]"


def test_the_input_reference_tells_all():
    page = reference_markdown()
    for name in QUANTITIES:
        assert f"`{name}`" in page
    assert "- with `through`, through a patch: flow_rate (volume per time, out of the box or along the normal)" in page
