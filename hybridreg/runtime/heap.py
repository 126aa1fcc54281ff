# SPDX-License-Identifier: MIT
"""How the C library hands freed memory back to the system."""

from __future__ import annotations

import ctypes
import sys

# Parameters of glibc's mallopt (malloc.h).
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
_KEPT = 1 << 30  # bytes; blocks smaller than this are not handed back


def keep_freed_memory() -> bool:
    """Let this process keep what it frees: a training step asks for the same tensors again and again, and each new page
    of them has to be cleared by the system first. Whether it could be set: glibc alone knows how."""
    if not sys.platform.startswith("linux"):
        return False
    set_option = getattr(ctypes.CDLL(None), "mallopt", None)
    return set_option is not None and all(
        set_option(option, _KEPT) == 1 for option in (_TRIM_THRESHOLD, _MMAP_THRESHOLD)
    )
