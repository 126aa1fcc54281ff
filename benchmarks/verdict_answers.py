# SPDX-License-Identifier: MIT
"""Answers of `default` to simulated training pairs, with their evidence: what the verdict's rules are fitted to.

Every tier of `sim:train`, disjoint pairs too, and the worlds of the verdict's tests (rooms, corridors, yards, woods).
An answer is the best pose after the first recipe and after the last that `default` runs; and, as if the right pose had
not been found, the best wrong one. The support learns from all poses that were found at last, and from the true one
where none of them is right: which of these is it, if any? No real pair and no validation or test pair takes part.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import hybridreg as hr
from benchmarks.made_sights import sight
from hybridreg.data import open_dataset
from hybridreg.eval import metrics
from hybridreg.matches import Correspondences, Pose
from hybridreg.pair import Pair
from hybridreg.scene import Scene
from hybridreg.verdict import matched, support, weigh
from hybridreg.verdict.rivals import Rival, as_pose, told_apart

Array = NDArray[np.float64]
Row = dict[str, Any]
TIERS = ("near", "mid", "far", "degenerate", "disjoint", "worlds")
# Pairs of each tier before this one taught the shipped networks, which find more on them than on others.
FIRST = 2000
# Poses of a pair that are ranked beside one another, at most.
_RANKED = 8
# A wrong answer where the right one was found would seldom be given: so much it counts, beside a right one.
AS_IF = 0.15


def pairs(tier: str, indices: range) -> Iterator[tuple[str, Pair, Array | None, float]]:
    """Name, clouds, true pose (None where there is none) and metres within which a pose is right."""
    if tier == "worlds":
        for i in indices:
            here = sight(i)
            yield f"world-{i}", here.pair, here.truth, 0.2 if here.indoor else 0.5
        return
    data = open_dataset(f"sim:train/{tier}#{FIRST + indices.stop}")
    for i in indices:
        labelled = data.load(FIRST + i)
        truth = None if tier == "disjoint" else labelled.T_target_source
        yield labelled.pair.id, labelled.pair, truth, 0.5


def answers(scene: Scene, truth: Array | None, metres: float) -> Iterator[Row]:
    """Evidence of the answers to one pair."""
    candidates = hr.Pipeline.preset("default").estimate
    stages: list[list[Rival]] = []
    for found in candidates.stages(scene, Correspondences.none(), np.random.default_rng(0)):
        if found:
            stages.append(found)
            if weigh(scene, as_pose(found)).confidence >= candidates.enough:
                break
    looked_at = [stages[0], stages[-1]] if len(stages) > 1 else stages
    for found in looked_at:
        right = [_right(one.T, truth, metres) for one in found]
        share = 1.0 / len(looked_at)
        ranked = _ranked(scene, found, truth, metres) if found is stages[-1] else None
        yield {**_told(scene, found), "right": right[0] is True, "weight": share, "ranked": ranked}
        wrong = [one for one, well in zip(found, right, strict=True) if well is False]
        if right[0] and wrong:
            yield {**_told(scene, wrong), "right": False, "weight": share * AS_IF}


def _told(scene: Scene, found: list[Rival]) -> Row:
    weighed = weigh(scene, as_pose(found))
    rival = [
        {**weigh(scene, Pose(one.T, found=False)).evidence, "closeness": one.closeness}
        for one in weighed.rivals[:1]
    ]
    return {"evidence": weighed.evidence, "rival": rival}


def _ranked(scene: Scene, found: list[Rival], truth: Array | None, metres: float) -> Row:
    # Evidence of the poses, and the rows of the right ones. What is nearly right is left out.
    poses = [(one, _right(one.T, truth, metres)) for one in found[:_RANKED]]
    poses = [pose for pose in poses if pose[1] is not None]
    if truth is not None and not any(right for _, right in poses):
        own = support.support(support.numbers(*support.seen(scene, truth)))
        poses = [*poses, (Rival(truth, own, matched=matched.share(scene, truth)), True)]
    told = told_apart(scene, [one._replace(closeness=0.0) for one, _ in poses])
    evidence = [
        support.numbers(*support.seen(scene, one.T), one.recipes, one.matched, one.closeness) for one in told
    ]
    return {"evidence": evidence, "right": [k for k, (_, right) in enumerate(poses) if right]}


def _right(T: Array, truth: Array | None, metres: float) -> bool | None:
    # None between right (2 degrees) and wrong (5 degrees, or four times the metres).
    if truth is None:
        return False
    rre, rte = metrics.rre_deg(T, truth), metrics.rte_m(T, truth)
    if rre < 2.0 and rte < metres:
        return True
    return False if rre > 5.0 or rte > 4.0 * metres else None


def _rows(job: tuple[str, int]) -> list[Row]:
    tier, i = job
    (name, pair, truth, metres), *_ = pairs(tier, range(i, i + 1))
    return [{"pair": name, "tier": tier, **row} for row in answers(hr.VoxelGrid()(pair), truth, metres)]


def gather(path: Path, n_pairs: int, workers: int) -> None:
    """Append the rows of pairs that the file does not hold."""
    held = read(path)
    n_held = {tier: len({row["pair"] for row in held if row["tier"] == tier}) for tier in TIERS}
    jobs = [(tier, i) for i in range(n_pairs) for tier in TIERS if i >= n_held[tier]]
    with ProcessPoolExecutor(workers) as pool, path.open("a") as file:
        for rows in pool.map(_rows, jobs):
            file.write("".join(json.dumps(row) + "\n" for row in rows))
            file.flush()


def read(path: Path) -> list[Row]:
    """Rows of an earlier call; none where there was none."""
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
