# SPDX-License-Identifier: MIT
"""Files and folders that a command is told to write: refused before the work and not after it."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Iterable
from pathlib import Path

from hybridreg.io.atomic import check_target


def check_folder(folder: Path | None, written: Iterable[str] = (), read: Iterable[str | Path] = ()) -> None:
    """Refuse a folder that cannot be made or written to, or in which one of the files that are `read` has the name of
    one that is `written`."""
    if folder is None:
        return
    taken = _real(read)
    for path in (folder / name for name in written):
        if os.path.realpath(path) in taken:
            raise ValueError(f"{path}: is read, and would be written over; choose another --out")
    whole = folder.absolute()
    standing = next(path for path in (whole, *whole.parents) if os.path.lexists(path))
    if not standing.is_dir():
        number = errno.EEXIST if standing == whole else errno.ENOTDIR
    elif not os.access(standing, os.W_OK | os.X_OK):
        number = errno.EACCES
    else:
        _try(standing, folder)
        return
    raise OSError(number, os.strerror(number), str(folder))


def _try(standing: Path, folder: Path) -> None:
    # Permissions do not tell of /proc, of shares and of root.
    try:
        os.rmdir(tempfile.mkdtemp(prefix=".hybridreg-", dir=standing))
    except OSError as error:
        if error.errno in (errno.ENOENT, errno.EPERM, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL):
            reason = f"nothing can be written to {standing} ({os.strerror(error.errno)})"
            raise ValueError(f"{folder}: {reason}; name another folder") from error
        raise OSError(error.errno, error.strerror, str(folder)) from error


def check_file(path: Path | None, out: Path | None = None) -> None:
    """Refuse a file that cannot be written; the folder `out` will be there."""
    if path is None:
        return
    folder = Path(os.path.realpath(path)).parent
    if out is None or folder != Path(os.path.realpath(out)):
        check_target(path)
        check_folder(folder)


def check_clouds(
    paths: Iterable[Path | None], read: Iterable[str | Path] = (), out: Path | None = None
) -> None:
    """Refuse files that no cloud is written to, that cannot be written, that are `read`, or that are named twice."""
    taken = _real(read)
    written: set[str] = set()
    for path in paths:
        if path is None:
            continue
        if path.suffix.lower() not in (".ply", ".pcd"):
            raise ValueError(f"{path}: clouds are written as .ply or .pcd; choose such a name")
        real = os.path.realpath(path)
        if real in taken:
            raise ValueError(
                f"{path}: is one of the clouds that are read, and would be lost; choose another name"
            )
        if real in written:
            raise ValueError(f"{path}: two clouds would be written to this file; choose another name for one")
        written.add(real)
        check_file(path, out)


def _real(paths: Iterable[str | Path]) -> set[str]:
    return {os.path.realpath(path) for path in paths}
