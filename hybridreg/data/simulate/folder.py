# SPDX-License-Identifier: MIT
"""Writes simulated pairs as folders, compactly, and reads them back identically."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np

from hybridreg.cloud import PointCloud
from hybridreg.data.simulate.drawn import Drawn, draw
from hybridreg.data.simulate.jpeg import decode
from hybridreg.data.simulate.labelled import pair_id
from hybridreg.data.simulate.overlaps import thin
from hybridreg.data.simulate.splits import VERSION, pair_number
from hybridreg.pair import LabelledPair, Pair


def write_pair(folder: Path, drawn: Drawn, facts: dict[str, Any], voxel: float | None) -> Path:
    """One pair as `folder`: source.npz, target.npz, image.jpg, meta.json. The folder appears whole or not at all.

    Coordinates lie on a grid of 1/256 m, so their float32 numbers end in zero bits and compress to about a half;
    thinned clouds lie in the order of their cubes and compress better still.
    """
    part = folder.with_name(f".{folder.name}-{uuid4().hex[:8]}")
    part.mkdir(parents=True)
    try:
        for name, cloud in (("source", drawn.source), ("target", drawn.target)):
            points = cloud if voxel is None else thin(cloud, voxel)
            np.savez_compressed(part / f"{name}.npz", xyz=np.asfortranarray(points))
        (part / "image.jpg").write_bytes(drawn.jpeg)
        (part / "meta.json").write_text(json.dumps(_meta(drawn, facts, voxel), indent=1) + "\n")
        if folder.exists():
            shutil.rmtree(folder)
        os.replace(part, folder)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return folder


def _meta(drawn: Drawn, facts: dict[str, Any], voxel: float | None) -> dict[str, Any]:
    return {
        "T_target_source": drawn.T_target_source.tolist(),
        "source_sensor": drawn.source_sensor,
        "target_sensor": drawn.target_sensor,
        "overlap": drawn.overlap,
        "scene": drawn.scene,
        "voxel": voxel,
        "version": VERSION,
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
    """Draw pair `index` and write it below `out`; a pair that lies there whole already is kept."""
    folder = out / f"{tier}-{split}-{seed}-{index:06d}"
    if not (folder / "meta.json").is_file():
        facts = {
            "tier": tier,
            "split": split,
            "seed": seed,
            "index": index,
            "id": pair_id(split, tier, seed, index),
        }
        write_pair(folder, draw(tier, pair_number(split, seed, index)), facts, voxel)
    return folder


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

    An interrupted run goes on where it stopped. `voxel=0.25` makes a pair some 250 kB, 5 to 6 bytes a point.
    """
    from joblib import Parallel, delayed

    jobs = (delayed(write_one)(Path(out), tier, split, seed, index, voxel) for index in range(pairs))
    yield from Parallel(n_jobs=workers, return_as="generator")(jobs)
