# SPDX-License-Identifier: MIT
"""Reading a file's bytes, with an error that says what is at the path instead of a file."""

from __future__ import annotations

import re
from pathlib import Path

from hybridreg.io.faults import fault

# Folders that hold one cloud in many files, of which none is the cloud, by a file in each: what they are, and the cure.
_TREES = {
    "ept.json": ("a cloud in pieces (EPT)", "make one file of them: pdal translate ept://FOLDER out.laz"),
    "octree.bin": ("a cloud in pieces (Potree)", "give the file that it was made of"),
    "cloud.js": ("a cloud in pieces (Potree 1)", "give the file that it was made of"),
}
# Of EPT: depth and three numbers of a cell; of Potree 1: r and a digit a level.
_PIECE = re.compile(r"\d+-\d+-\d+-\d+\.(?:laz|bin)|r[0-7]*\.(?:bin|las|laz)")
_UP = 8  # folders above a piece of Potree 1, whose names are cut into folders


def check_file(path: Path) -> None:
    """Refuse a missing path, a folder, a device, a pipe, a name that no file can have, and a piece of a cloud that EPT
    or Potree has cut up: one of them holds a part, or every so many points."""
    try:
        if path.is_dir():
            what, cure = _tree_in(path) or ("a folder", "name one file inside it")
            raise IsADirectoryError(f"{path}: is {what}; {cure}")
        if not path.exists():
            raise FileNotFoundError(
                f"{path}: no such file; check the name (the current folder is {Path.cwd()})"
            )
        if not path.is_file():
            raise ValueError(f"{path}: is a device or a pipe; copy its content to a file first")
        tree = _tree_of(path)
        if tree is not None:
            raise fault(str(path), f"is one file of {tree[0]}, and no whole one", tree[1])
    except (FileNotFoundError, IsADirectoryError):
        raise
    except OSError as error:  # a name that is too long, a share that is gone
        raise ValueError(
            f"{str(path)[:200]}: cannot be looked up ({error.strerror}); check the name"
        ) from error


def _tree_in(folder: Path) -> tuple[str, str] | None:
    return next((words for name, words in _TREES.items() if (folder / name).is_file()), None)


def _tree_of(path: Path) -> tuple[str, str] | None:
    if path.name == "octree.bin" and (path.parent / "hierarchy.bin").is_file():
        return _TREES[path.name]
    if not _PIECE.fullmatch(path.name):
        return None
    return next(filter(None, map(_tree_in, list(path.resolve().parents)[:_UP])), None)


def read_whole(path: Path) -> bytes:
    """All bytes of the file at `path`."""
    check_file(path)
    try:
        return path.read_bytes()
    except MemoryError as error:
        size = path.stat().st_size
        raise fault(str(path), f"its {size} bytes do not fit in memory", "cut it into parts") from error
