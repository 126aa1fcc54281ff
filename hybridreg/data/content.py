# SPDX-License-Identifier: MIT
"""Hashes of files, without reading them again where they look unchanged."""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from hybridreg.io.atomic import write_text

# Size, modification and change times (nanoseconds; no tool resets the latter), inode.
Looks = tuple[int, int, int, int]

# A file written in the clock tick in which it was read could be written again without looking different.
_YOUNG_NS = 2_000_000_000
_BLOCK = 1 << 20

_KNOWN: dict[str, tuple[Looks, str]] = {}


def digest(path: str | os.PathLike[str]) -> str:
    """A hash of a file's content; the last hash where the file looks unchanged since.

    A file that cannot be read has the hash "unreadable": whoever needs its content reports that.
    """
    place = os.path.abspath(path)
    try:
        looks = looks_of(place)
        known = _KNOWN.get(place)
        if known is not None and known[0] == looks:
            return known[1]
        found = _hash(place)
    except OSError:
        return "unreadable"
    if _is_settled(looks):
        _KNOWN[place] = looks, found
    return found


def looks_of(path: str | os.PathLike[str]) -> Looks:
    """What is known of a file without reading it."""
    stat = os.stat(path)
    return stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns, stat.st_ino


def looks_of_all(paths: Iterable[str | os.PathLike[str]]) -> str:
    """What is known of files without reading them, as one short text; empty where one is too recent to tell, or
    gone."""
    total = hashlib.blake2b(digest_size=16)
    try:
        for path in paths:
            looks = looks_of(path)
            if not _is_settled(looks):
                return ""
            total.update(repr((os.path.abspath(path), looks)).encode("utf-8", "backslashreplace"))
    except OSError:
        return ""
    return total.hexdigest()


@contextmanager
def kept_in(file: Path | None) -> Iterator[None]:
    """Use hashes of an earlier process within the block, and store those of this one in `file`.

    Optional: a file that is damaged or cannot be written only costs the hashing.
    """
    if file is None:
        yield
        return
    with suppress(OSError, ValueError, TypeError, AttributeError, IndexError):
        for place, (looks, found) in json.loads(file.read_text(encoding="utf-8")).items():
            size, written, changed, number = looks
            _KNOWN.setdefault(place, ((size, written, changed, number), str(found)))
    before = dict(_KNOWN)
    yield
    if before != _KNOWN:
        with suppress(OSError):
            file.parent.mkdir(parents=True, exist_ok=True)
            write_text(file, json.dumps(_KNOWN))


def _is_settled(looks: Looks) -> bool:
    return time.time_ns() - max(looks[1], looks[2]) > _YOUNG_NS


def _hash(path: str) -> str:
    found = hashlib.blake2b(digest_size=16)
    with open(path, "rb") as file:
        while block := file.read(_BLOCK):
            found.update(block)
    return found.hexdigest()
