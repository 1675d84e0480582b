"""No import circle: modules can be read one after the other, those that a module needs before it."""

from __future__ import annotations

from graphlib import CycleError, TopologicalSorter

import grimp

PACKAGES = ("fsci", "solvers", "coupling")


def test_no_file_imports_itself_through_others():
    """Imports for type checkers count too: what cannot be named without a circle is in the wrong file."""
    graph = grimp.build_graph(*PACKAGES)
    needed = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    try:
        order = list(TopologicalSorter(needed).static_order())
    except CycleError as error:
        raise AssertionError(" imports ".join(reversed(error.args[1]))) from None
    assert len(order) > 200
