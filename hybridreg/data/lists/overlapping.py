# SPDX-License-Identifier: MIT
"""Leaving out pairs that hardly overlap: measured once, then stored beside the data as JSON."""

from __future__ import annotations

import json
import warnings
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hybridreg.data.lists.pair_files import PairFiles
from hybridreg.io import write_json


def overlapping(
    entries: Sequence[PairFiles], root: Path, least: float, radius: float
) -> list[tuple[PairFiles, float]]:
    """Pairs whose overlap is at least `least`, with their overlap.

    All overlaps are measured the first time, which reads every cloud, and written to
    `root/hybridreg-overlaps-<key>.json`; the key changes with the pairs, their poses, the radius, and the size and
    time of every cloud.

    Warns
    -----
    UserWarning
        `root` cannot be written to, so that overlaps are measured again next time.
    """
    from hybridreg.data.lists.direction import overlap

    file = root / f"hybridreg-overlaps-{_key(entries, radius)}.json"
    shares = _kept(file, entries)
    if shares is None:
        shares = {entry.id: overlap(entry.read(), radius) for entry in entries}
        _keep(file, radius, shares)
    return [(entry, shares[entry.id]) for entry in entries if shares[entry.id] >= least]


def _key(entries: Sequence[PairFiles], radius: float) -> str:
    digest = zlib.crc32(repr(radius).encode())
    for entry in entries:
        looks = f"{entry.id} {_looks(entry.source)} {_looks(entry.target)}"
        digest = zlib.crc32(looks.encode() + np.round(entry.T_target_source, 9).tobytes(), digest)
    return f"{digest:08x}"


def _looks(file: Path) -> tuple[int, int]:
    stat = file.stat()
    return stat.st_size, stat.st_mtime_ns


def _kept(file: Path, entries: Sequence[PairFiles]) -> dict[str, float] | None:
    try:
        shares = json.loads(file.read_text(encoding="utf-8"))["overlap"]
        return {entry.id: float(shares[entry.id]) for entry in entries}
    except (OSError, ValueError, KeyError, TypeError):  # none yet, or damaged: it is replaced
        return None


def _keep(file: Path, radius: float, shares: dict[str, float]) -> None:
    try:
        write_json(file, {"radius": radius, "overlap": shares})
    except OSError as error:
        warnings.warn(
            f"{file}: not written ({error}); overlaps are measured again next time", UserWarning, stacklevel=2
        )
