# SPDX-License-Identifier: MIT
"""Answers of `default` to simulated training pairs, with their evidence: what the verdict's rules are fitted to.

Every tier of `sim:train`, disjoint pairs too, some thinned to a few hundred points, the worlds of the verdict's tests
(rooms, corridors, yards, woods), and the hard kinds of `hybridreg.data.hard` with even seeds (maps, vehicle frames,
objects, crops, mirrored and scaled clouds). An answer is the best pose after the first recipe and after the last that
`default` runs; and, as if the right pose had not been found, the best wrong one. The support learns from all poses that
were found at last, and from the true one where none of them is right: which of these is it, if any? No real pair and no
validation or test pair takes part.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import hybridreg as hr
from hybridreg.cloud import PointCloud
from hybridreg.data import hard, open_dataset
from hybridreg.data.hard.box_world_scans import sight
from hybridreg.eval.score import metrics
from hybridreg.evidence import match_agreement, views
from hybridreg.evidence.evidence import Evidence
from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.frames import lower_pose
from hybridreg.geometry import se3
from hybridreg.matches import Correspondences, Pose
from hybridreg.pair import Pair
from hybridreg.scene import Scene
from hybridreg.search.hypothesis import Hypothesis, as_pose
from hybridreg.search.ranking import told_apart
from hybridreg.verdict import weigh

Array = NDArray[np.float64]
Row = dict[str, Any]
TIERS = ("near", "mid", "far", "degenerate", "disjoint", "few", "worlds", "hard")
# What is thinned to a few points, in turn.
_THINNED = ("near", "mid", "disjoint")
# Pairs of each tier before this one taught the shipped networks, which find more on them than on others.
FIRST = 2000
# Poses of a pair that are ranked beside one another, at most.
_RANKED = 8
# A wrong answer where the right one was found would seldom be given: so much it counts, beside a right one.
AS_IF = 0.15


class Labelled(NamedTuple):
    """Two clouds, every right pose (none where no pose is right), and the metres within which a pose is right."""

    name: str
    pair: Pair
    truths: tuple[Array, ...]
    metres: float


def labelled(tier: str, i: int) -> Labelled:
    """The i-th pair of a tier."""
    if tier == "worlds":
        here = sight(i)
        return Labelled(f"world-{i}", here.pair, (here.truth,), 0.2 if here.indoor else 0.5)
    if tier == "hard":
        one = hard.sample(hard.KINDS[i % len(hard.KINDS)], 2 * (i // len(hard.KINDS)))
        return Labelled(one.name, Pair.of(one.source, one.target, id=one.name), one.truths, one.metres)
    if tier == "few":
        return _few(labelled(_THINNED[i % len(_THINNED)], i), np.random.default_rng([i, 0]))
    simulated: Any = open_dataset(f"sim:train/{tier}#{FIRST + i + 1}")
    pair = simulated.load(FIRST + i)
    truths = () if tier == "disjoint" else (pair.T_target_source,)
    return Labelled(pair.pair.id, pair.pair, truths, 0.5)


def _few(one: Labelled, rng: np.random.Generator) -> Labelled:
    # 150 to 1,000 points of the source, and often of the target too, drawn at random.
    def some(cloud: PointCloud) -> Array:
        n = int(np.exp(rng.uniform(np.log(150), np.log(1000))))
        return cloud.points[np.sort(rng.permutation(len(cloud.points))[:n])]

    source, target = one.pair.source, one.pair.target
    clouds = some(source), some(target) if rng.random() < 0.6 else target.points
    return one._replace(name=f"few-{one.name}", pair=Pair.of(*clouds, id=f"few-{one.name}"))


def answers(scene: Scene, truths: Sequence[Array], metres: float) -> Iterator[Row]:
    """Evidence of the answers to one pair."""
    candidates = hr.Pipeline.preset("default").estimate
    stages: list[list[Hypothesis]] = []
    for found in candidates.stages(scene, Correspondences.none(), np.random.default_rng(0)):
        if found:
            stages.append(found)
            if weigh(scene, as_pose(found)).confidence >= candidates.enough:
                break
    looked_at = [stages[0], stages[-1]] if len(stages) > 1 else stages
    for found in looked_at:
        right = [_right(scene, one.T, truths, metres) for one in found]
        share = 1.0 / len(looked_at)
        ranked = _ranked(scene, found, truths, metres) if found is stages[-1] else None
        yield {**_told(scene, found), "right": right[0] is True, "weight": share, "ranked": ranked}
        wrong = [one for one, well in zip(found, right, strict=True) if well is False]
        if right[0] and wrong:
            yield {**_told(scene, wrong), "right": False, "weight": share * AS_IF}


def _told(scene: Scene, found: list[Hypothesis]) -> Row:
    weighed = weigh(scene, as_pose(found))
    rival = [
        {**weigh(scene, Pose(one.T, found=False)).evidence.as_dict(), "closeness": one.closeness}
        for one in weighed.rivals[:1]
    ]
    return {"evidence": weighed.evidence.as_dict(), "rival": rival}


def _ranked(scene: Scene, found: list[Hypothesis], truths: Sequence[Array], metres: float) -> Row:
    # Evidence of the poses, and the rows of the right ones. What is nearly right is left out.
    poses = [(one, _right(scene, one.T, truths, metres)) for one in found[:_RANKED]]
    poses = [pose for pose in poses if pose[1] is not None]
    if truths and not any(right for _, right in poses):
        truth = lower_pose(truths[0], scene.pair)
        at = PoseEvidence(views.of(scene), truth)
        matched = match_agreement.share(scene, truth)
        poses = [*poses, (Hypothesis(at=at, by_surfaces=at.by_surfaces, matched=matched), True)]
    told = told_apart([one.but(closeness=0.0) for one, _ in poses])
    evidence = [
        Evidence.at(one.at.agreement, one.at.information, one.found_by, one.matched, one.closeness)
        for one in told
    ]
    return {
        "evidence": [one.as_dict() for one in evidence],
        "right": [k for k, (_, right) in enumerate(poses) if right],
    }


def _right(scene: Scene, T: Array, truths: Sequence[Array], metres: float) -> bool | None:
    # None between right (2 degrees) and wrong (5 degrees, or four times the metres). Metres are those by which the
    # middle of the source moves: in a frame with a far origin a translation says more about the turn.
    middle = np.median(scene.pair.source.points, axis=0)[None]
    wrong = True
    for truth in (lower_pose(truth, scene.pair) for truth in truths):
        rre = metrics.rre_deg(T, truth)
        gap = float(np.linalg.norm(se3.apply(T, middle) - se3.apply(truth, middle)))
        if rre < 2.0 and gap < metres:
            return True
        wrong &= rre > 5.0 or gap > 4.0 * metres
    return False if wrong else None


def _rows(job: tuple[str, int]) -> list[Row]:
    tier, i = job
    try:
        name, pair, truths, metres = labelled(tier, i)
        return [{"pair": name, "tier": tier, **row} for row in answers(hr.VoxelGrid()(pair), truths, metres)]
    except Exception as error:  # one pair that fails must not end hours of work
        print(f"{tier} {i}: {type(error).__name__}: {error}", flush=True)
        return [{"pair": f"{tier}-{i}", "tier": tier, "left_out": str(error)}]


def gather(path: Path, n_pairs: int, workers: int) -> None:
    """Append the rows of pairs that the file lacks: `n_pairs` of each tier, and six times as many hard or few."""
    held = {(row["tier"], row["job"]) for row in _lines(path)}
    jobs = [
        (tier, i)
        for k in range(n_pairs)
        for tier in TIERS
        for i in (range(6 * k, 6 * k + 6) if tier in ("hard", "few") else (k,))
        if (tier, i) not in held
    ]
    with ProcessPoolExecutor(workers) as pool, path.open("a") as file:
        for (_, i), rows in zip(jobs, pool.map(_rows, jobs), strict=True):
            file.write("".join(json.dumps({**row, "job": i}) + "\n" for row in rows))
            file.flush()


def read(path: Path) -> list[Row]:
    """Rows of an earlier call; none where there was none."""
    return [row for row in _lines(path) if "left_out" not in row]


def _lines(path: Path) -> list[Row]:
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
