"""The cheapest sizes within a tolerance, where the answer is known."""

import math

import pytest

from fsci.converge.cheapest import Option, cheapest
from fsci.converge.estimate import Estimate
from fsci.converge.results import BandedValue


def finding(band, errors, order=None, outside=(), scatter=0.0):
    told = Estimate(1.0, band, order, "resolved", levels_say=band, errors=errors, outside=outside, scatter=scatter)
    return BandedValue(told, 1.0)


def any_size(*sources):
    return dict.fromkeys(sources, math.inf)


def test_only_what_is_wrong_gets_finer():
    """All of the error is that of the step: of second order, a quarter of it needs half of the step."""
    found = finding(0.013, {"cells": 0.0, "step": 0.01})
    choice = cheapest([found], [Option(100.0)], any_size("cells", "step"), 2, 0.01301 / 4.0)
    assert choice.factors == pytest.approx({"cells": 2.0, "step": 0.5})


def test_first_order_needs_more():
    found = finding(0.013, {"step": 0.01}, order=1.0)
    choice = cheapest([found], [Option(100.0)], any_size("step"), 2, 0.01301 / 4.0)
    assert choice.factors == pytest.approx({"step": 0.25})
    assert choice.seconds == pytest.approx(401.1)


def test_a_coarser_case_is_enough():
    found = finding(0.01, {"cells": 0.01 / 1.3})
    choice = cheapest([found], [Option(10.0)], any_size("cells"), 2, 0.041)
    assert choice.factors == pytest.approx({"cells": 2.0})
    assert choice.seconds < 10.0


def test_the_other_element():
    """It costs as much and has a tenth of the error."""
    found = finding(0.01, {"cells": 0.01 / 1.3})
    options = [Option(10.0), Option(10.0, "element", "cells")]
    choice = cheapest([found], options, any_size("cells"), 2, 0.0011)
    assert choice.option.twin == "element"
    assert choice.factors == pytest.approx({"cells": 1.0})


def test_the_other_element_has_the_error_that_it_shows():
    """Its value is 4 % off: a quarter of that needs half of all sizes."""
    told = finding(0.01, {"cells": 0.01 / 1.3}).estimate
    found = BandedValue(told, 1.0, twins={"element": 1.04})
    choice = cheapest([found], [Option(10.0, "element", "cells")], any_size("cells", "facets"), 2, 0.0101)
    assert choice.factors == pytest.approx({"cells": 0.5, "facets": 0.5})


def test_the_other_element_in_no_larger_cells_than_it_was_run_with():
    found = finding(0.01, {"cells": 0.01 / 1.3})
    choice = cheapest([found], [Option(10.0, "element", "cells")], any_size("cells"), 2, 0.5)
    assert choice.factors == pytest.approx({"cells": 1.0})


def test_factors_are_those_of_the_case():
    """The band of a level of half the size is a quarter of that of the case."""
    told = finding(0.01 / 4.0, {"cells": 0.01 / 1.3 / 4.0}).estimate
    choice = cheapest([BandedValue(told, 1.0, size=0.5)], [Option(10.0)], any_size("cells"), 2, 0.0101)
    assert choice.factors == pytest.approx({"cells": 1.0})


def test_mesh_files_have_no_larger_cells():
    found = finding(0.01, {"files": 0.01 / 1.3})
    assert cheapest([found], [Option(10.0)], {"files": 1.0}, 2, 0.5).factors == {"files": 1.0}
    assert cheapest([found], [Option(10.0)], {"files": 2.0}, 2, 0.5).factors == {"files": 2.0}


def test_out_of_reach():
    assert cheapest([finding(0.5, {"cells": 0.3})], [Option(10.0)], any_size("cells"), 3, 1e-6) is None
    nothing = BandedValue(Estimate(1.0, None, None, "not resolved"), 1.0)
    assert cheapest([nothing], [Option(10.0)], any_size("cells"), 3, 0.1) is None


def test_all_values_count():
    cells, step = finding(0.013, {"cells": 0.01, "step": 0.0}), finding(0.013, {"cells": 0.0, "step": 0.01})
    choice = cheapest([cells, step], [Option(100.0)], any_size("cells", "step"), 2, 0.0151)
    assert choice.factors == pytest.approx({"cells": 1.0, "step": 1.0})
