# SPDX-License-Identifier: MIT
"""Writes simulated pairs as folders, compactly, and reads them back identically."""

from __future__ import annotations

import json
import os
import shutil
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np

from hybridreg.cloud import PointCloud
from hybridreg.data.simulate.difficulty import tier_named
from hybridreg.data.simulate.drawn import Drawn, draw
from hybridreg.data.simulate.labelled import pair_id
from hybridreg.data.simulate.sensing.jpeg import decode
from hybridreg.data.simulate.sensing.thinned import thinned
from hybridreg.data.simulate.splits import pair_number
from hybridreg.io.faults import naming
from hybridreg.io.lock import folder_lock
from hybridreg.pair import LabelledPair, Pair
from hybridreg.runtime.workers import spread


def write_pair(folder: Path, drawn: Drawn, facts: dict[str, Any], voxel: float | None) -> Path:
    """One pair as `folder`: source.npz, target.npz, image.jpg, meta.json. The folder appears whole or not at all.

    Coordinates are plain float32 metres that `numpy.load` reads, on a grid of 1/256 m, or of a sixteenth of the
    voxel: their numbers end in zero bits and compress well.
    """
    part = folder.with_name(f".{folder.name}-{uuid4().hex[:8]}")
    try:
        with naming(folder, instead_of=part):
            part.mkdir(parents=True)
            for name, cloud in (("source", drawn.source), ("target", drawn.target)):
                _write_cloud(part / f"{name}.npz", thinned(cloud, voxel), small=voxel is not None)
            (part / "image.jpg").write_bytes(drawn.jpeg)
            (part / "meta.json").write_text(json.dumps(_meta(drawn, facts, voxel), indent=1) + "\n")
            if folder.exists():
                shutil.rmtree(folder)
            os.replace(part, folder)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return folder


def _write_cloud(path: Path, points: np.ndarray, small: bool) -> None:
    # LZMA takes 0.1 s for a thinned cloud and 1 s for a whole one: there it would cost more than the simulation.
    method = zipfile.ZIP_LZMA if small else zipfile.ZIP_DEFLATED
    with zipfile.ZipFile(path, "w", method) as archive, archive.open("xyz.npy", "w") as member:
        np.lib.format.write_array(member, np.asfortranarray(points), allow_pickle=False)


def _meta(drawn: Drawn, facts: dict[str, Any], voxel: float | None) -> dict[str, Any]:
    return {
        "T_target_source": drawn.T_target_source.tolist(),
        "source_sensor": drawn.source_sensor,
        "target_sensor": drawn.target_sensor,
        "overlap": drawn.overlap,
        "scene": drawn.scene,
        "voxel": voxel,
        "version": drawn.version,
        **facts,
    }


def read_pair(folder: Path) -> LabelledPair:
    """A folder that `write_pair` wrote.

    Raises
    ------
    FileNotFoundError
        Where one of its four files is missing.
    """
    meta = json.loads((folder / "meta.json").read_text())
    clouds = []
    for name in ("source", "target"):
        with np.load(folder / f"{name}.npz") as stored:
            points = np.ascontiguousarray(stored["xyz"])
        clouds.append(PointCloud.of(points, name=f"{folder.name} {name}", sensor=meta[f"{name}_sensor"]))
    pair = Pair(
        source=clouds[0],
        target=clouds[1],
        image=decode((folder / "image.jpg").read_bytes()),
        id=meta["id"],
        meta={"scene": meta["scene"], "version": meta["version"]},
    )
    return LabelledPair(pair=pair, T_target_source=np.array(meta["T_target_source"]), overlap=meta["overlap"])


def write_one(out: Path, tier: str, split: str, seed: int, index: int, voxel: float | None) -> Path:
    """Generate pair `index` and write it below `out`; a complete pair that is already there is kept.

    Raises
    ------
    ValueError
        Where the pair that is there was thinned differently, or made by another version.
    """
    folder = out / f"{tier}-{split}-{seed}-{index:06d}"
    if (folder / "meta.json").is_file():
        _check_kept(folder, voxel, tier_named(tier).version)
        return folder
    facts = {
        "tier": tier,
        "split": split,
        "seed": seed,
        "index": index,
        "id": pair_id(split, tier, seed, index),
    }
    return write_pair(folder, draw(tier, pair_number(split, seed, index)), facts, voxel)


def _check_kept(folder: Path, voxel: float | None, version: int) -> None:
    meta = json.loads((folder / "meta.json").read_text())
    for key, now in (("version", version), ("voxel", voxel)):
        if meta.get(key) != now:
            raise ValueError(
                f"{folder}: holds a pair of {key} {meta.get(key)}, not {now}; write to another folder"
            )


def write_pairs(
    out: str | Path,
    *,
    tier: str = "mid",
    pairs: int = 20,
    seed: int = 1,
    split: str = "train",
    voxel: float | None = None,
    workers: int = 1,
) -> Iterator[Path]:
    """Write `pairs` pairs below `out`, yielding each folder as it is done, in order.

    An interrupted run continues where it stopped. With `voxel=0.25` a pair takes some 140 kB, 3 bytes a point.

    Raises
    ------
    ValueError
        Before anything is written: an unknown tier or split, a seed or number of pairs outside it, a voxel of
        no width.
    InUse
        Another process is writing these pairs there.
    OSError
        `out` cannot be written to, or the disk is full; pairs that are done are kept.
    """
    tier_named(tier)
    if pairs < 1:
        raise ValueError(f"pairs={pairs}; ask for one at least")
    pair_number(split, seed, pairs - 1)
    if voxel is not None and not 0 < voxel < np.inf:
        raise ValueError(f"voxel={voxel} m must be positive")
    return _written(Path(out), tier, split, seed, pairs, voxel, workers)


def _written(
    out: Path, tier: str, split: str, seed: int, pairs: int, voxel: float | None, workers: int
) -> Iterator[Path]:
    # A folder may be written for several tiers at a time, but no pair by two writers.
    out.mkdir(parents=True, exist_ok=True)
    with folder_lock(out, f"{tier}-{split}-{seed}"):
        jobs = ((out, tier, split, seed, index, voxel) for index in range(pairs))
        yield from spread(write_one, jobs, workers, ordered=True)
