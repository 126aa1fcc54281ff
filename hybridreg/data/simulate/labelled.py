# SPDX-License-Identifier: MIT
"""Simulated pairs as the library's `LabelledPair`."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count

from hybridreg.cloud import PointCloud
from hybridreg.data.simulate.drawn import Drawn, draw
from hybridreg.data.simulate.sensing.jpeg import decode
from hybridreg.data.simulate.sensing.sensors import Sensor
from hybridreg.data.simulate.sensing.thinned import thinned
from hybridreg.data.simulate.splits import pair_number
from hybridreg.pair import LabelledPair, Pair


def to_labelled(drawn: Drawn, id: str, voxel: float | None = None) -> LabelledPair:
    """`drawn` with its image decoded; `voxel` thins the clouds to one measured point per voxel of that edge."""
    clouds = [thinned(cloud, voxel) for cloud in (drawn.source, drawn.target)]
    pair = Pair(
        source=PointCloud.of(clouds[0], name=f"{id} source", sensor=drawn.source_sensor),
        target=PointCloud.of(clouds[1], name=f"{id} target", sensor=drawn.target_sensor),
        image=decode(drawn.jpeg),
        id=id,
        meta={"scene": drawn.scene, "version": drawn.version},
    )
    return LabelledPair(pair=pair, T_target_source=drawn.T_target_source, overlap=drawn.overlap)


def pair_id(split: str, tier: str, seed: int, index: int) -> str:
    """`sim:test/near/1/17`: what `pair` needs to generate it again."""
    return f"sim:{split}/{tier}/{seed}/{index}"


def pair(
    tier: str = "mid",
    *,
    seed: int = 1,
    index: int = 0,
    split: str = "train",
    voxel: float | None = None,
    source: Sensor | None = None,
    target: Sensor | None = None,
) -> LabelledPair:
    """Generate one simulated pair; the same arguments give the same bytes, alone or in a run.

    Parameters
    ----------
    tier : str
        "near" (5 m), "mid" (15 m), "far" (30 m), "degenerate" or "disjoint".
    seed, index, split
        Which pair; the splits "train", "val" and "test" never share a scene.
    voxel : float, optional
        Thin both clouds to one point per voxel of this edge in metres.
    source, target : Sensor, optional
        Use these instead of drawing them from the table.

    Raises
    ------
    ValueError
        For an unknown tier or split, or a seed or index outside it.
    """
    number = pair_number(split, seed, index)
    return to_labelled(draw(tier, number, source, target), pair_id(split, tier, seed, index), voxel)


def pairs(
    tier: str = "mid",
    *,
    seed: int = 1,
    split: str = "train",
    voxel: float | None = None,
    start: int = 0,
    step: int = 1,
) -> Iterator[LabelledPair]:
    """An endless sequence of simulated pairs: `pair(tier, ..., index)` for index = start, start + step, ...

    Worker k of n passes `start=k, step=n` and the workers' pairs together are those of a single run.
    """
    return (pair(tier, seed=seed, index=index, split=split, voxel=voxel) for index in count(start, step))
