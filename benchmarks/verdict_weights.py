# SPDX-License-Identifier: MIT
"""The rules behind the verdict, fitted to what `default` considers on simulated training pairs.

    python -m benchmarks.verdict_weights gather --rows runs/evidence.jsonl --pairs 40
    python -m benchmarks.verdict_weights fit --rows runs/evidence.jsonl --write hybridreg/verdict

`gather` runs the recipes of `default` on `sim:train` (every tier, disjoint pairs too) and on the worlds of the
verdict's tests (rooms, corridors, yards, woods), and writes one line for each answer: its evidence, that of its best
rival, and whether it is right. An answer is the best pose after the first recipe and after the last that `default`
runs; and, as if the right pose had not been found, the best wrong one. `fit` prints how the rule does on pairs that
it was not fitted to (five-fold), and writes it. No real pair and no validation or test pair takes part.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import hybridreg as hr
from benchmarks.boosting import boost, plain
from benchmarks.calibration import draw
from benchmarks.made_sights import sight
from hybridreg.data import open_dataset
from hybridreg.eval import metrics
from hybridreg.matches import Correspondences, Pose
from hybridreg.pair import Pair
from hybridreg.scene import Scene
from hybridreg.verdict import weigh
from hybridreg.verdict.boosted import Boosted
from hybridreg.verdict.confidence import NO_RIVAL, OK, believed, features
from hybridreg.verdict.rivals import Rival
from hybridreg.verdict.support import terms

Array = NDArray[np.float64]
Row = dict[str, Any]
TIERS = ("near", "mid", "far", "degenerate", "disjoint", "worlds")
# Pairs of each tier before this one taught the shipped networks, which find more on them than on others.
FIRST = 2000
# A wrong answer where the right one was found would seldom be given: so much it counts, beside a right one.
AS_IF = 0.15
# Penalty on the squared weights of the standardised terms, per answer.
RIDGE = 3e-4


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
            if weigh(scene, _pose(found)).confidence >= OK:
                break
    looked_at = [stages[0], stages[-1]] if len(stages) > 1 else stages
    for found in looked_at:
        right = [_right(one.T, truth, metres) for one in found]
        share = 1.0 / len(looked_at)
        yield {**_told(scene, found), "right": right[0] is True, "weight": share}
        wrong = [one for one, well in zip(found, right, strict=True) if well is False]
        if right[0] and wrong:
            yield {**_told(scene, wrong), "right": False, "weight": share * AS_IF}


def _told(scene: Scene, found: list[Rival]) -> Row:
    weighed = weigh(scene, _pose(found))
    rival = [weigh(scene, Pose(one.T, found=False)).evidence for one in weighed.rivals[:1]]
    return {"evidence": weighed.evidence, "rival": rival}


def _pose(found: list[Rival]) -> Pose:
    return replace(Pose.ranked([one.T for one in found]), recipes=found[0].recipes)


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


def fit_support(rows: list[Row]) -> tuple[dict[str, float], float]:
    """Weights of the terms and intercept under which the rows are likeliest: either the pose is right, or its best
    rival is, or neither, each by the odds that its own terms give it."""
    from scipy.optimize import minimize

    own, rival, right, weight = _arrays(rows)
    middle, width = own.mean(axis=0), own.std(axis=0)

    def score(X: Array, v: Array) -> Array:
        return np.maximum((X - middle) / width @ v[:-1] + v[-1], -50.0)

    def loss(v: Array) -> float:
        s = score(own, v)
        r = np.where(np.isnan(rival[:, 0]), -50.0, score(np.nan_to_num(rival), v))
        all_of_them = np.logaddexp(np.logaddexp(0.0, s), r)
        nll = all_of_them - np.where(right, s, np.logaddexp(0.0, r))
        return float(weight @ nll + RIDGE * weight.sum() * v[:-1] @ v[:-1])

    # What speaks for a pose never speaks against it: the terms of looking through are the only objections.
    sign = [
        (None, 0.0) if name.startswith("looked_through") else (0.0, None)
        for name in terms(rows[0]["evidence"])
    ]
    v = minimize(loss, np.zeros(len(sign) + 1), method="L-BFGS-B", bounds=[*sign, (None, None)]).x
    weights = v[:-1] / width
    return dict(zip(terms(rows[0]["evidence"]), weights.tolist(), strict=True)), float(
        v[-1] - middle @ weights
    )


def _arrays(rows: list[Row]) -> tuple[Array, Array, NDArray[np.bool_], Array]:
    own = np.array([list(terms(row["evidence"]).values()) for row in rows])
    lacking = [np.nan] * own.shape[1]
    rival = np.array([list(terms(row["rival"][0]).values()) if row["rival"] else lacking for row in rows])
    return own, rival, np.array([row["right"] for row in rows]), np.array([row["weight"] for row in rows])


@dataclass(frozen=True)
class Rule:
    """What `fit` found: the support's terms and the confidence's trees."""

    weights: dict[str, float]
    intercept: float
    trees: Boosted
    stored_trees: dict[str, Any]


def fit(rows: list[Row]) -> Rule:
    """The rule under which the rows are likeliest: support first, then trees on what it says and the rest."""
    weights, intercept = fit_support(rows)
    told = [features(evidence) for evidence in _with_support(rows, weights, intercept)]
    right, weight = np.array([row["right"] for row in rows]), np.array([row["weight"] for row in rows])
    stored = plain(boost(told, right, weight))
    return Rule(weights, intercept, Boosted.read(stored), stored)


def _with_support(rows: list[Row], weights: dict[str, float], intercept: float) -> Iterator[dict[str, float]]:
    # The evidence, with support and margin as this rule tells them.
    for row in rows:
        own, *rival = (
            intercept + sum(weights[name] * value for name, value in terms(evidence).items())
            for evidence in (row["evidence"], *row["rival"])
        )
        yield {**row["evidence"], "support": own, "rival_margin": rival[0] - own if rival else NO_RIVAL}


def predicted(rows: list[Row], rule: Rule) -> Array:
    """Probability of each row under a rule."""
    told = [features(evidence) for evidence in _with_support(rows, rule.weights, rule.intercept)]
    return np.array([believed(rule.trees(row), row["rival_margin"]) for row in told])


def unseen(rows: list[Row], folds: int = 5) -> Array:
    """Probability of each row under the rule fitted to the other pairs."""
    names = sorted({row["pair"] for row in rows})
    fold = dict(zip(names, np.random.default_rng(0).permutation(len(names)) % folds, strict=True))
    its = np.array([fold[row["pair"]] for row in rows])
    p = np.zeros(len(rows))
    for k in range(folds):
        rule = fit([row for row, f in zip(rows, its, strict=True) if f != k])
        p[its == k] = predicted([row for row, f in zip(rows, its, strict=True) if f == k], rule)
    return p


def report(rows: list[Row], p: Array) -> None:
    """Print how probabilities `p` do, in all and for each tier."""
    right, weight = np.array([row["right"] for row in rows]), np.array([row["weight"] for row in rows])
    tier = np.array([row["tier"] for row in rows])
    print(f"{len(rows)} answers: Brier score {np.average((p - right) ** 2, weights=weight):.4f}")
    for name in TIERS:
        good, bad = p[right & (tier == name)], p[~right & (tier == name)]
        print(
            f"  {name:10s} of {len(good):3d} right answers {np.mean(good >= OK) if len(good) else 0:4.0%} ok; "
            f"of {len(bad):3d} wrong ones {np.sum(bad >= OK):2d} ok"
        )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=["gather", "fit"])
    parser.add_argument("--rows", type=Path, default=Path("runs/evidence.jsonl"))
    parser.add_argument("--pairs", type=int, default=40, help="of each tier")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--write", type=Path, help="folder in which to write the rule as JSON")
    parser.add_argument("--picture", type=Path, help="draw the reliability curve of the five folds")
    options = parser.parse_args()
    if options.what == "gather":
        gather(options.rows, options.pairs, options.workers)
        return
    rows = read(options.rows)
    p = unseen(rows)
    report(rows, p)
    if options.picture:
        draw(p, np.array([row["right"] for row in rows]), options.picture)
    rule = fit(rows)
    support = {
        "weights": {k: round(w, 3) for k, w in rule.weights.items()},
        "intercept": round(rule.intercept, 3),
    }
    print(json.dumps(support, indent=2))
    if options.write:
        (options.write / "support.json").write_text(json.dumps(support, indent=2) + "\n")
        (options.write / "confidence.json").write_text(json.dumps(rule.stored_trees) + "\n")


if __name__ == "__main__":
    main()
