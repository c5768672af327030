"""numba's functions that count references, kept compiled as kernels are.

Every process that calls a kernel needs them, and numba compiles them in each anew: some 20 ms.
"""

import hashlib
from typing import Any

from numba.core.runtime import nrtdynmod

from evoexp.numeric.code_keys import compilers
from evoexp.numeric.kept_files import MESSAGES, cache_root
from evoexp.numeric.kept_libraries import FORMAT, LibraryFiles

_NAME = "reference_counts"  # begins the names of the files


def use_kept_runtime() -> None:
    """Have numba keep these functions, and load them where they are kept, from now on."""
    nrtdynmod.compile_nrt_functions = _loaded_or_compiled


def _loaded_or_compiled(context: Any) -> Any:
    """Return the library of the functions."""
    codegen = context.codegen()
    state = hashlib.sha256(" ".join(compilers()).encode()).hexdigest()[:16]
    folder = cache_root() / "kernels" / nrtdynmod.__name__ / f"{state}{FORMAT}"
    files, processor = LibraryFiles(folder, _NAME), codegen.magic_tuple()
    kept = files.load(processor)
    if kept is not None:
        return codegen.unserialize_library(kept[0])
    module, library = nrtdynmod.create_nrt_module(context)
    library.enable_object_caching()
    library.add_ir_module(module)
    library.finalize()
    try:
        files.save(processor, (library.serialize_using_object_code(),))
    except OSError as error:
        MESSAGES.say("not kept", f"{folder}: {error.strerror or error}; kernels are not kept")
    return library
