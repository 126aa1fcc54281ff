# SPDX-License-Identifier: MIT
"""Links on disk as they are found, so that a run that was cut off goes on, to the same result."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hybridreg.io.line_file import LineFile
from hybridreg.many.kept_rows import kept, looks
from hybridreg.many.link_search import Key
from hybridreg.many.links import Link


class LinkFile(dict[Key, Link]):
    """Links by the rows of their clouds and the pose that they started from; each that is set becomes a line.

    Lines name files, not rows, with their size and time: a cloud may be added, and what is told of one that has
    changed since is not taken.

    Parameters
    ----------
    files : of the clouds, in the order of their rows
    settings : what the links depend on besides
    on_link : called for each new one

    Raises
    ------
    ValueError
        The file is damaged, or was made with other settings.
    """

    def __init__(
        self,
        path: Path,
        files: Sequence[str],
        settings: Mapping[str, Any],
        *,
        overwrite: bool = False,
        on_link: Callable[[], None] = lambda: None,
    ) -> None:
        super().__init__()
        self._on_link = on_link
        self._looks = [looks(file) for file in files]
        held = not overwrite and kept(path, settings, self._take)
        self._file = LineFile(path, anew=not held)
        if not held:
            self._file.add(json.dumps(settings))

    def __setitem__(self, key: Key, link: Link) -> None:
        a, b, start = key
        row = {
            "clouds": [self._looks[a], self._looks[b]],
            "start": start,
            "T_target_source": link.T_target_source.tolist(),
            "verdict": link.verdict,
            "confidence": link.confidence,
            "metres": link.metres,
            "rivals": link.rivals.tolist(),
        }
        self._file.add(json.dumps(row))
        super().__setitem__(key, link)
        self._on_link()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _take(self, rows: list[Any]) -> bool:
        row_of = {look: row for row, look in enumerate(self._looks)}
        for row in rows:
            a, b = (row_of.get(look) for look in row["clouds"])
            if a is None or b is None or a > b:
                continue
            start = None if row["start"] is None else tuple(map(float, row["start"]))
            link = Link(
                source=b,
                target=a,
                T_target_source=np.array(row["T_target_source"], dtype=np.float64).reshape(4, 4),
                verdict=str(row["verdict"]),
                confidence=float(row["confidence"]),
                metres=float(row["metres"]),
                rivals=np.array(row.get("rivals", []), dtype=np.float64).reshape(-1, 4, 4),
            )
            super().__setitem__((a, b, start), link)
        return True
