"""The calls that differ between generations of DOLFINx, chosen by what is installed.

Both modules have the same functions. A generation is recognised by its functions, not by its number.
"""

from __future__ import annotations

from importlib.util import find_spec

if find_spec("basix.ufl") is None:
    from solvers.fem import pybind as calls
else:
    from dolfinx import fem

    if not hasattr(fem, "create_form"):
        raise ImportError(
            "this version of DOLFINx is not supported: install 0.5 (Debian 12), or 0.9 (Debian 13) and later",
            name="dolfinx",
        )
    from solvers.fem import nanobind as calls  # type: ignore[no-redef]

__all__ = ["calls"]
