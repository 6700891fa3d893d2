"""Machine code from the disk, without what only other functions that call it need to be compiled.

Numba keeps LLVM's form beside the machine code, and parses it as it loads: as long as all else takes. It is wanted only
where a function is compiled that calls this one, and then it is parsed here.

This rests on how Numba works inside, the same from 0.60 to 0.68; see ``KNOWN`` in kernels.jit.cache.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import llvmlite.binding as llvm
from numba.core.codegen import JITCodeLibrary


class Loaded(JITCodeLibrary):
    """A library of which LLVM's form is parsed when it is first asked for.

    Numba asks LLVM for the address of a function only if it knows that there is one, for LLVM ends the process where
    there is none. That LLVM's form would tell; here the names in the machine code do.
    """

    bitcode: bytes | None = None
    names: bytes = b""

    @classmethod
    def _unserialize(cls, codegen: Any, state: tuple[str, str, Any]) -> Any:
        name, kind, data = state
        if kind != "object":
            return super()._unserialize(codegen, state)
        library = codegen.create_library(name)
        code, library.bitcode = data
        library.names = code
        library.enable_object_caching()
        library._set_compiled_object(code)
        library._finalize_final_module()
        return library

    def get_pointer_to_function(self, name: str) -> int:
        """The address of a function of this library; 0 where it has none of that name."""
        if b"\0" + name.encode() + b"\0" in self.names:
            self._codegen._engine._defined_symbols.add(name)
        else:  # or names stand elsewhere
            self._get_module_for_linking()
        address: int = super().get_pointer_to_function(name)
        return address

    def _get_module_for_linking(self) -> Any:
        if self._shared_module is None and self.bitcode is not None:
            self._shared_module = llvm.parse_bitcode(self.bitcode)
            self._codegen._engine._load_defined_symbols(self._shared_module)
        return super()._get_module_for_linking()


@contextmanager
def loaded(context: Any) -> Iterator[None]:
    """What is loaded meanwhile is so. context: of Numba's target. Numba loads under its lock."""
    codegen = context.codegen()
    before = codegen._library_class
    codegen._library_class = Loaded
    try:
        yield
    finally:
        codegen._library_class = before
