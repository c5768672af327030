"""Compiled libraries that are kept: their machine code at once, what others inline of them later.

numba keeps both and reads both, although a process that compiles nothing inlines nothing. Reading
it takes half of the time that a kept kernel takes to load.
"""

from typing import Any

from llvmlite import binding
from numba.core.codegen import JITCodeLibrary, JITCPUCodegen

from evoexp.numeric.kernel_files import KernelFiles

FORMAT = "-symbols"  # ends the names of folders with such libraries, which numba's own cannot read
_OF_NUMBA, _KEPT = "object", "evoexp"  # kinds of serialised libraries


class KeptLibrary(JITCodeLibrary):
    """A library that reads the code to be inlined when it is asked for."""

    _bitcode: bytes | None = None

    @classmethod
    def _unserialize(cls, codegen: Any, state: tuple[str, str, Any]) -> Any:
        name, kind, data = state
        if kind != _KEPT:
            return super()._unserialize(codegen, state)
        library = codegen.create_library(name)
        machine_code, library._bitcode, symbols = data
        library.enable_object_caching()
        library._set_compiled_object(machine_code)
        library._finalize_final_module()
        codegen._engine._defined_symbols.update(symbols)
        return library

    def _get_module_for_linking(self) -> Any:
        if self._bitcode is not None:
            self._shared_module, self._bitcode = binding.parse_bitcode(self._bitcode), None
        return super()._get_module_for_linking()


class LibraryFiles(KernelFiles):
    """The files of one kernel, whose libraries are kept such that they can be read in parts."""

    def save(self, key: Any, data: Any) -> None:
        """Keep a form that numba serialised, its library with the names of all that it defines."""
        library, *others = data
        super().save(key, (_with_symbols(library), *others))


def _with_symbols(library: tuple[str, str, Any]) -> tuple[str, str, Any]:
    name, kind, data = library
    if kind != _OF_NUMBA:
        return library
    machine_code, bitcode = data
    module = binding.parse_bitcode(bitcode)
    groups = module.functions, module.global_variables
    symbols = [each.name for group in groups for each in group if not each.is_declaration]
    return name, _KEPT, (machine_code, bitcode, symbols)


def use_kept_libraries() -> None:
    """Have numba make its libraries such that they can be read in parts, from now on."""
    JITCPUCodegen._library_class = KeptLibrary
