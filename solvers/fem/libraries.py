"""Compiled forms as plain C libraries.

FFCx makes a Python module of each form. Most of the compiler's time for a small form then goes into Python's header and
the lines that describe the same structures again. Here the library of a form has its functions alone. The structures
are described once, by a Python file in the cache.
"""

from __future__ import annotations

import ctypes
import hashlib
import importlib.util
import os
import sysconfig
from contextlib import chdir
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from cffi import FFI, ffiplatform, recompiler
from ffcx.codegeneration import jit

#: What FFCx declares, in an order in which each part knows what it needs. Newer versions have no elements and dofmaps.
PARTS = ("HEADER", "ELEMENT", "DOFMAP", "INTEGRAL", "FORM", "EXPRESSION")

#: first word of an object's name -> its structure
STRUCTURES = {
    "element": "ufcx_finite_element", "dofmap": "ufcx_dofmap", "form": "ufcx_form", "expression": "ufcx_expression",
}  # fmt: skip


class Builder:
    """Makes the library. FFCx calls it as it calls `cffi.FFI`."""

    def __init__(self) -> None:
        self._name, self._code, self._options = "", "", dict[str, Any]()

    def set_source(self, name: str, code: str, **options: Any) -> None:
        self._name, self._code, self._options = name, code, options

    def cdef(self, declarations: str) -> None:
        """They are those of `_structures`."""

    def compile(self, tmpdir: Path, verbose: bool, debug: bool | None) -> None:
        with chdir(tmpdir):  # where the compiler leaves its parts
            Path(f"{self._name}.c").write_text(self._code)
            extension = ffiplatform.get_extension(f"{self._name}.c", self._name, **self._options)
            ffiplatform.compile(".", extension, verbose, debug)


def load(folder: Path, name: str, objects: list[str]) -> tuple[list[Any], Any]:
    """Objects of a library by their names, and what stands for its module: `ffi`, and constants in `lib`."""
    ffi, constants = _structures(folder)
    library = ctypes.CDLL(str(folder / (name + sysconfig.get_config_var("EXT_SUFFIX"))))
    found = []
    for one in objects:
        address = ctypes.addressof(ctypes.c_byte.in_dll(library, one))
        found.append(ffi.cast(f"{STRUCTURES[one.partition('_')[0]]} *", address)[0])
    return found, SimpleNamespace(ffi=ffi, lib=constants)


@cache
def _structures(folder: Path) -> tuple[Any, Any]:
    """The structures of FFCx, which it takes longer to read than to import, and its constants."""
    header, *parts = (getattr(jit, f"UFC_{part}_DECL", "") for part in PARTS)
    text = "".join([header.format("double"), *parts])
    name = f"libffcx_structures_{hashlib.sha1(text.encode()).hexdigest()}"
    path = folder / f"{name}.py"
    if not path.exists():
        made = FFI()
        made.cdef(text)
        made.set_source(name, None)
        own = folder / f"{name}.{os.getpid()}"  # the file is whole when it gets its name
        recompiler.make_py_source(made, name, str(own))
        own.replace(path)
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.ffi, module.ffi.dlopen(None)
