# SPDX-License-Identifier: MIT
"""Out of memory, whichever library reports it, in one sentence."""

from __future__ import annotations

import errno

_LEAST = 1600 * 2**20

# Messages of libraries that mean MemoryError: torch, C++, OpenCV, the dynamic linker, threads, BLAS.
_SAID = (
    "not enough memory",
    "can't allocate memory",
    "cannot allocate memory",
    "bad_alloc",
    "insufficient memory",
    "out of memory",
    "failed to map segment",
    "failed to allocate",
    "can't start new thread",
    "unable to allocate",
)


def lacks_memory(error: BaseException) -> bool:
    """Was this raised for lack of memory?"""
    if isinstance(error, MemoryError) or (isinstance(error, OSError) and error.errno == errno.ENOMEM):
        return True
    text = str(error).lower()
    return any(said in text for said in _SAID)


def memory_sentence(error: BaseException) -> str:
    """The message: what was requested, what limits it, and what to do."""
    told = " ".join(str(error).split())[:200]
    what = f"not enough memory{f' ({told})' if told else ''}"
    limit = address_space()
    if limit is not None:
        return (
            f"{what}: this shell allows {limit / 2**20:.0f} MB of addresses; raise it (ulimit -v unlimited)"
        )
    return f"{what}; take a larger --voxel or fewer --workers, or thin the clouds first"


def require_addresses() -> None:
    """Refuse a limit under which the libraries cannot even be imported: some of them end the process, some never end.

    Raises
    ------
    MemoryError
        `ulimit -v` is below 1.6 GB.
    """
    limit = address_space()
    if limit is not None and limit < _LEAST:
        raise MemoryError("the libraries alone take 1.6 GB of addresses, training 3 GB")


def address_space() -> int | None:
    """Bytes of addresses that this process may have (`ulimit -v`); None without a limit."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    soft, _ = resource.getrlimit(resource.RLIMIT_AS)
    return None if soft == resource.RLIM_INFINITY else soft
