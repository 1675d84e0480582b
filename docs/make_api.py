"""Page of the Python API: python docs/make_api.py > docs/reference/api.md. Docstrings say shapes and units."""

from __future__ import annotations

import inspect
import re
from importlib import import_module
from typing import Any

#: package -> what it is for
PACKAGES = {
    "solvers.structure": "elastic bodies",
    "solvers.contact": "contact between surfaces",
    "solvers.fluid": "flow on a fixed grid",
    "solvers.rigid": "rigid bodies that loads and the flow move",
    "coupling": "fluid and bodies together",
    "solvers.newton": "the nonlinear iteration",
    "solvers.api": "what the parts exchange",
}

INTRODUCTION = """\
# Python API

This page is generated from the docstrings. [Use from Python](../library.md) shows the names at work.
All of them may be imported from the package in whose chapter they stand.
"""


def page() -> str:
    """All chapters."""
    return "\n".join([INTRODUCTION, *(chapter(name, words) for name, words in PACKAGES.items())])


def chapter(package: str, words: str) -> str:
    """The public names of a package."""
    module = import_module(package)
    names = getattr(module, "__all__", None) or own_names(module)
    return "\n".join([f"## `{package}`: {words}\n", *(entry(name, getattr(module, name)) for name in names)])


def own_names(module: Any) -> list[str]:
    """The public classes and functions that a module defines."""
    defined = inspect.getmembers(module, lambda one: getattr(one, "__module__", "") == module.__name__)
    return [name for name, one in defined if not name.startswith("_") and (inspect.isclass(one) or callable(one))]


def entry(name: str, thing: Any) -> str:
    """Signature, docstring and, of classes, the public methods."""
    lines = [f"### {name}\n", "```python", signature(name, thing), "```\n", text(thing), ""]
    if inspect.isclass(thing):
        lines += [f"`{field}`\n: {plain(words)}\n" for field, words in fields(thing)]
        for method, function in vars(thing).items():
            if not method.startswith("_") and inspect.isfunction(function) and function.__doc__:
                lines.append(f"`{method}{short(function)}`\n: {paragraph(function)}\n")
    return "\n".join(lines)


def signature(name: str, thing: Any) -> str:
    """How it is called; one argument per line if there are many."""
    try:
        found = inspect.signature(thing)
    except (TypeError, ValueError):
        return name
    parts = [re.sub(r"<mpi4py\S+ object at \w+>", "MPI.COMM_WORLD", str(one)) for one in found.parameters.values()]
    parts = [re.sub(r"<[\w.]*?(\w+) object at \w+>", r"\1()", part) for part in parts]
    parts = [re.sub(r"<(?:function|class) '?([\w.]+).*?>", r"\1", part).replace("'", "") for part in parts]
    line = f"{name}({', '.join(parts)})"
    return line if len(line) < 100 else f"{name}(\n    " + ",\n    ".join(parts) + ",\n)"


def short(function: Any) -> str:
    """The names of the arguments."""
    return "(" + ", ".join(name for name in inspect.signature(function).parameters if name != "self") + ")"


def text(thing: Any) -> str:
    """The docstring as it stands, without marks of Markdown or code that it might be taken for."""
    found = inspect.getdoc(thing) or ""
    if found.startswith(f"{getattr(thing, '__name__', '')}("):
        found = ""  # what a dataclass without a docstring gets
    return f"```text\n{found}\n```" if found else ""


def fields(thing: type) -> list[tuple[str, str]]:
    """(name, comment) of the attributes that the source explains with #: beside them."""
    return re.findall(r"^    (\w+): [^#\n]*#: (.*)$", inspect.getsource(thing), re.MULTILINE)


def paragraph(function: Any) -> str:
    """The first paragraph of a docstring in one line."""
    return plain(" ".join((inspect.getdoc(function) or "").split("\n\n")[0].split()))


def plain(words: str) -> str:
    """A text without what Markdown would take for its marks, except for code in backticks."""
    parts = words.split("`")
    marks = {"<": "&lt;", "*": r"\*", "_": r"\_", "|": r"\|", "[": r"\[", "$": r"\$"}
    parts[::2] = [re.sub(r"[<*_|\[$]", lambda found: marks[found[0]], part) for part in parts[::2]]
    return "`".join(parts)


if __name__ == "__main__":
    print(page())
