# SPDX-License-Identifier: MIT
"""What lies in files, told without reading them again where they look as they did."""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from hybridreg.io.atomic import write_text

# Size, times of writing and of change (nanoseconds; no tool sets the latter back), number of the file.
Looks = tuple[int, int, int, int]

# A file written in the tick in which it was read could be written again without looking different.
_YOUNG_NS = 2_000_000_000
_BLOCK = 1 << 20

_KNOWN: dict[str, tuple[Looks, str]] = {}


def digest(path: str | os.PathLike[str]) -> str:
    """A hash of a file's content; of a file that looks as it did when it was last hashed, that hash.

    A file that cannot be read has "unreadable": to tell so is the business of whoever needs its content.
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
    """How a file looks from outside."""
    stat = os.stat(path)
    return stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns, stat.st_ino


def looks_of_all(paths: Iterable[str | os.PathLike[str]]) -> str:
    """How files look from outside, as one short text; empty where one of them is too young to tell, or gone."""
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
    """Know within the block what an earlier process hashed, and note in `file` what this one does.

    An extra: a note that is damaged or cannot be written only costs the hashing.
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
