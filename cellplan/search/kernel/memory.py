"""Memory that is freed stays at hand: the kernel works with many arrays of about a megabyte."""

from functools import cache
from typing import Final

import numpy as np

CACHE_BYTES: Final = (
    24_000_000  # more than all arrays of one call, less than the 32 MB beyond which glibc learns nothing
)


@cache
def keep_freed_memory() -> None:
    """Teach the allocator of glibc to keep what is freed: pages that are given back cost more than the arithmetic.

    The largest block that was freed decides up to which size it takes blocks from its heap, and how much of that it
    keeps. Nothing is touched, so nothing is used; other allocators do as they always do.
    """
    np.empty(CACHE_BYTES, dtype=np.uint8)
