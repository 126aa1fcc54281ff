# SPDX-License-Identifier: MIT
"""A folder of pairs: a folder each with `source.*`, `target.*`, perhaps `image.*`, and `meta.json`."""

from __future__ import annotations

import hashlib
import inspect
import os
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from hybridreg import gate
from hybridreg.config.plain_values import value_of
from hybridreg.data import content
from hybridreg.data.dataset import Dataset
from hybridreg.data.lists import dataset_options, direction
from hybridreg.geometry import se3
from hybridreg.io.structured import read_json
from hybridreg.pair import LabelledPair, Pair
from hybridreg.resolution import VEHICLES, tolerance

# Folders whose poses' direction this process has looked at.
_CHECKED: set[tuple[str, bool]] = set()
# Only these fields reach the pair: others in a meta.json may contain the pose, or allow computing it.
_FREE_FACTS = ("kind", "source_sensor", "target_sensor", "licence")


class PairFolder(Dataset):
    """Pairs in the sub-folders of `root`; those with neither a source nor a `meta.json` are skipped.

    Parameters
    ----------
    root : path
        `root/<id>/source.*` and `target.*` are clouds of any format that `hybridreg.io` reads, `image.*` is a
        camera image, and `meta.json` holds `T_target_source`, 4x4, row by row, metres; perhaps `source_viewpoint` and
        `target_viewpoint`: [x, y, z] where the sensor stood in its cloud's frame, "none", or
        {"places": [[x, y, z], ...], "of_point": [row of each point's place, ...]}.
    inverted : bool
        The `T_target_source` of every `meta.json` maps target to source, and is to be inverted.
    trusted : bool
        The poses' direction is certain: tables, predictions and training do not look at it first.

    Raises
    ------
    FileNotFoundError
        Saying what is missing and where it must be.
    ValueError
        Two files where one is expected.
    """

    def __init__(self, root: str | os.PathLike[str], inverted: bool = False, trusted: bool = False) -> None:
        folder = Path(root)
        if not folder.is_dir():
            raise FileNotFoundError(
                f"{folder}: there is no such folder; it must hold one folder for each pair"
            )
        self.root, self.inverted, self.trusted = folder, inverted, trusted
        self._ids = tuple(sorted(f.name for f in folder.iterdir() if _is_pair(f)))
        if not self.ids:
            raise FileNotFoundError(
                f"{folder}: no pairs; each must be a folder {folder.name}/<id>/ with source.*, target.* "
                "and meta.json"
            )
        for name in self.ids:
            _files(folder / name)

    @classmethod
    def from_text(cls, text: str) -> PairFolder:
        """Open it by "PATH", "PATH#inverted" or "PATH#trusted"."""
        path, options = dataset_options.parse(text, inspect.signature(cls))
        return cls(path, **options)

    @property
    def ids(self) -> tuple[str, ...]:
        return self._ids

    def load(self, index: int) -> LabelledPair:
        labelled = load_pair(self.root / self.ids[index])
        if not self.inverted:
            return labelled
        return replace(labelled, T_target_source=se3.inverse(labelled.T_target_source))

    read = load

    @property
    def if_inverted(self) -> str:
        """What to do if the poses map target to source."""
        undo = f"without inverted: {self.root}" if self.inverted else f"by {self.root}#inverted"
        return f"open the folder {undo}; {self.root}#trusted takes them as they are"

    @property
    def overlap_radius(self) -> float:
        """Metres within which two points count as the same place: as far as a right pose may be off, of the first pair
        that can be read."""
        for index in range(len(self)):
            with suppress(OSError, ValueError):
                pair = self.load(index).pair
                return tolerance(pair.source, pair.target).metres
        return VEHICLES.metres

    def vouch(self) -> None:
        """Look at the direction of a few poses, once a process.

        Raises
        ------
        WrongDirection
            Most of those that tell fit far better inverted.
        """
        names = " ".join(self.ids)
        key = f"{self.root.resolve()} {self.looks() or names}", self.inverted
        if self.trusted or key in _CHECKED:
            return
        direction.check(self, str(self.root), self.if_inverted, n=direction.A_FEW, clearly=True)
        _CHECKED.add(key)

    def fingerprint(self) -> str:
        digests = [self.pair_fingerprint(index) for index in range(len(self))]
        return hashlib.blake2b(repr(digests).encode(), digest_size=8).hexdigest()

    def looks(self) -> str:
        return content.looks_of_all(file for name in self.ids for file in _files(self.root / name).values())

    def pair_fingerprint(self, index: int) -> str:
        """From the content of the pair's own files, so that results stay valid when the folder grows."""
        name = self.ids[index]
        digests = {kind: content.digest(file) for kind, file in _files(self.root / name).items()}
        told = (name, sorted(digests.items()), *(["inverted"] if self.inverted else []))
        total = hashlib.blake2b(repr(told).encode(), digest_size=8)
        return f"{total.hexdigest()}-{name}"


def load_pair(folder: Path) -> LabelledPair:
    """Read the pair of one folder; its name is the pair's id."""
    files = _files(folder)
    meta = _read_meta(files["meta"])
    facts = {key: meta[key] for key in _FREE_FACTS if key in meta}
    try:
        pair = Pair.of(
            files["source"],
            files["target"],
            files.get("image"),
            id=folder.name,
            meta=facts,
            source_viewpoint=_viewpoint(meta, "source"),
            target_viewpoint=_viewpoint(meta, "target"),
        )
    except ValueError as error:
        raise ValueError(str(error).replace(gate.OR_DROP, "")) from error
    truth = se3.check(meta["T_target_source"], f"{files['meta']}: T_target_source")
    overlap = value_of(float | None, meta.get("overlap"), f"{files['meta']}: overlap")
    return LabelledPair(pair=pair, T_target_source=truth, overlap=overlap)


def _viewpoint(meta: dict[str, Any], side: str) -> Any:
    # "none", one place, or places and the row of each point's.
    place = meta.get(f"{side}_viewpoint", "auto")
    if isinstance(place, dict):
        return place.get("places"), place.get("of_point")
    return place


def _is_pair(folder: Path) -> bool:
    # A hidden folder was being written when its process was killed.
    if folder.name.startswith("."):
        return False
    return folder.is_dir() and ((folder / "meta.json").is_file() or any(folder.glob("source.*")))


def _files(folder: Path) -> dict[str, Path]:
    found = {}
    for kind in ("source", "target", "image"):
        candidates = sorted(folder.glob(f"{kind}.*"))
        if len(candidates) > 1:
            raise ValueError(f"{folder}: {len(candidates)} files are called {kind}.*; leave one of them")
        if candidates:
            found[kind] = candidates[0]
    if (folder / "meta.json").is_file():
        found["meta"] = folder / "meta.json"
    names = {"source": "source.*", "target": "target.*", "meta": "meta.json with T_target_source"}
    missing = [text for kind, text in names.items() if kind not in found]
    if missing:
        raise FileNotFoundError(f"{folder}: {' and '.join(missing)} missing; it must lie in that folder")
    return found


def _read_meta(path: Path) -> dict[str, Any]:
    meta = read_json(path)
    if not isinstance(meta, dict) or "T_target_source" not in meta:
        raise ValueError(
            f"{path}: T_target_source is missing; it must be the 4x4 pose that maps source to target"
        )
    return meta
