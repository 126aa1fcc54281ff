# SPDX-License-Identifier: MIT
"""Where a data set's files must be, and one sentence where they are not."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

# Formats in the order in which archives tend to use them.
CLOUDS = (".ply", ".pcd", ".bin", ".npy", ".npz", ".pth", ".las", ".laz", ".xyz", ".txt")
IMAGES = (".jpg", ".jpeg", ".png", ".webp", ".bmp", ".tif")


def folder(path: Path, what: str) -> Path:
    """`path`, if it is a folder.

    Raises
    ------
    FileNotFoundError
        "`what` is missing", with the path.
    """
    if not path.is_dir():
        raise FileNotFoundError(f"{what} is missing; it must be the folder {path}")
    return path


def first(paths: Iterable[Path], what: str) -> Path:
    """The first of `paths` that exists.

    Raises
    ------
    FileNotFoundError
        "`what` is missing", with all paths where it may be.
    """
    candidates = list(paths)
    for path in candidates:
        if path.is_file():
            return path
    raise FileNotFoundError(f"{what} is missing; it must lie at {' or '.join(map(str, candidates))}")


def frames(path: Path, what: str) -> dict[int, Path]:
    """Clouds of a folder by frame number, which is the file's name.

    Raises
    ------
    FileNotFoundError
        No such folder, or no cloud with a number for a name in it.
    """
    files = sorted(f for f in folder(path, what).iterdir() if f.suffix.lower() in CLOUDS)
    numbered = {int(f.stem): f for f in files if f.stem.isdecimal()}
    if not numbered:
        raise FileNotFoundError(
            f"{what} is missing: {path} has no cloud named by its number, such as 000000.bin or 000000.ply"
        )
    return numbered


class Shelf:
    """Which files exist, listed folder by folder: ten thousand clouds cost a few reads."""

    def __init__(self) -> None:
        self._names: dict[Path, frozenset[str]] = {}

    def has(self, path: Path) -> bool:
        """Whether `path` exists."""
        parent = path.parent
        if parent not in self._names:
            held = (each.name for each in parent.iterdir()) if parent.is_dir() else ()
            self._names[parent] = frozenset(held)
        return path.name in self._names[parent]

    def variant(self, path: Path, suffixes: tuple[str, ...]) -> Path | None:
        """`path`, or the file of the same name with another of `suffixes`; None where neither exists."""
        others = (path.with_suffix(suffix) for suffix in suffixes)
        return next((each for each in (path, *others) if self.has(each)), None)


def refuse_missing(wanted: Iterable[Path], what: str) -> None:
    """Raise one sentence with the number of missing files.

    Raises
    ------
    FileNotFoundError
        With their number and the first of them.
    """
    shelf, paths = Shelf(), list(dict.fromkeys(wanted))
    missing = [path for path in paths if not shelf.has(path)]
    if missing:
        raise FileNotFoundError(
            f"{len(missing)} of {len(paths)} files that {what} names are missing; "
            f"the first must lie at {missing[0]}"
        )
