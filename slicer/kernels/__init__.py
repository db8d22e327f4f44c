"""How the project's loops are compiled: whatever has one decorates it here, and knows nothing of numba.

``decorators`` says what kinds of kernels there are, ``machine_code`` where their code is kept and when it is
used again. The rest spares work while they are compiled: ``typing_memo``, ``struct_values`` and
``lean_library``. Nothing of the project is imported here.
"""

from slicer.kernels.decorators import (
    allocating_inner_kernel,
    bare_kernel,
    inner_kernel,
    is_kept,
    kernel,
    tell_of_compiling,
    vector_inner_kernel,
    widest,
)

__all__ = [
    "allocating_inner_kernel",
    "bare_kernel",
    "inner_kernel",
    "is_kept",
    "kernel",
    "tell_of_compiling",
    "vector_inner_kernel",
    "widest",
]
