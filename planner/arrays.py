"""Types of the arrays that values and functions hold, and the memory they are made in.

Each array says its shape and unit beside it.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

FloatArray: TypeAlias = "npt.NDArray[np.float64]"
IntArray: TypeAlias = "npt.NDArray[np.int64]"
IndexArray: TypeAlias = "npt.NDArray[np.intp]"
BoolArray: TypeAlias = "npt.NDArray[np.bool_]"
ComplexArray: TypeAlias = "npt.NDArray[np.complex128]"
TextArray: TypeAlias = "npt.NDArray[np.str_]"

_KEPT_BYTES = 16 << 20


@cache
def keep_freed_memory() -> None:
    """Let the C library keep the memory of arrays that are done with for those to come.

    glibc gives the end of its heap back with every larger array that is freed there, and gets it again page
    by page: a twentieth to a sixth of the time of a check of 1,000 items.  Once a large block was freed it
    keeps up to twice as much (mallopt(3): the dynamic threshold of ``M_MMAP_THRESHOLD``).  No page of the
    block is ever touched; other C libraries forget it.
    """
    np.empty(_KEPT_BYTES, np.uint8)
