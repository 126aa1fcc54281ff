# SPDX-License-Identifier: MIT
"""The rules behind the verdict, fitted to what `default` considers on simulated training pairs.

    python -m hybridreg.verdict.training gather --rows runs/evidence.jsonl --pairs 40
    python -m hybridreg.verdict.training fit --rows runs/evidence.jsonl --write hybridreg/verdict
    python -m hybridreg.verdict.training continue --rows runs/evidence.jsonl --write hybridreg/verdict
    python -m hybridreg.verdict.training continue --below compared 1000 --write hybridreg/verdict
    python -m hybridreg.verdict.training usual --rows runs/evidence.jsonl --write hybridreg/verdict

`gather` writes one line for each answer (`hybridreg.verdict.training.answers`): its evidence, that of its best
rival, that of all poses that were found, and what is right. `fit` prints how the rules do on pairs that they were not
fitted to (five-fold), and writes them. `continue` leaves the support and the trees as they are and adds trees for what
these answers say beside: new kinds of input, new evidence; with `--below` for those alone in which a number of the
evidence is not above a bound, so that no other verdict changes. `usual` writes the range that each number of right
poses has, which reports show (`hybridreg.verdict.training.usual_range`).
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.evidence import NO_RIVAL, Evidence
from hybridreg.evidence.log_odds import OK, model, terms
from hybridreg.io import write_json
from hybridreg.verdict.boosted import Boosted
from hybridreg.verdict.confidence import confidence, features
from hybridreg.verdict.training.answers import TIERS, Row, gather, read
from hybridreg.verdict.training.boosting import boost, continued, plain
from hybridreg.verdict.training.calibration import draw
from hybridreg.verdict.training.usual_range import ranges

Array = NDArray[np.float64]
# Penalty on the squared weights of the standardised terms, per answer.
RIDGE = 3e-4


def fit_support(rows: list[Row]) -> tuple[dict[str, float], float]:
    """Weights of the terms and intercept under which it is likeliest that of all poses of a pair the right one is
    right, or none where none is, each by the odds that its own terms give it."""
    from scipy.optimize import minimize

    names = list(terms(Evidence(**rows[0]["evidence"])))
    pairs = [row["ranked"] for row in rows if row.get("ranked") and row["ranked"]["evidence"]]
    X = np.array(
        [list(terms(Evidence(**evidence)).values()) for pair in pairs for evidence in pair["evidence"]]
    )
    first = np.cumsum([0, *(len(pair["evidence"]) for pair in pairs)])[:-1]
    right = np.concatenate([np.isin(np.arange(len(p["evidence"])), p["right"]) for p in pairs])
    none = np.array([not pair["right"] for pair in pairs])
    middle, width = X.mean(axis=0), X.std(axis=0)
    Z = (X - middle) / width

    def loss(v: Array) -> float:
        s = np.maximum(Z @ v[:-1] + v[-1], -50.0)
        of_all = np.logaddexp(0.0, np.logaddexp.reduceat(s, first))
        of_right = np.where(none, 0.0, np.logaddexp.reduceat(np.where(right, s, -100.0), first))
        return float(np.sum(of_all - of_right) + RIDGE * len(pairs) * v[:-1] @ v[:-1])

    # What speaks for a pose never speaks against it. Objections are what was looked through, and common ground, where
    # its likeness does not make up for it.
    against = ["through" in name or name == "log_relief_cells" for name in names]
    sign = [(None, 0.0) if objects else (0.0, None) for objects in against]
    v = minimize(loss, np.zeros(len(sign) + 1), method="L-BFGS-B", bounds=[*sign, (None, None)]).x
    weights = v[:-1] / width
    return dict(zip(names, weights.tolist(), strict=True)), float(v[-1] - middle @ weights)


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


def _with_support(rows: list[Row], weights: dict[str, float], intercept: float) -> Iterator[Evidence]:
    # The evidence, with support and margin as this rule tells them.
    for row in rows:
        own, *rival = (
            intercept + sum(weights[name] * value for name, value in terms(Evidence(**evidence)).items())
            for evidence in (row["evidence"], *row["rival"])
        )
        told = {**row["evidence"], "support": own, "rival_margin": rival[0] - own if rival else NO_RIVAL}
        yield Evidence(**told)


def longer(rows: list[Row], below: tuple[str, float] | None = None) -> Rule:
    """The shipped rule with more trees, fitted to these rows; `below` as in `boosting.continued`."""
    weights, intercept = model()
    told = [features(evidence) for evidence in _with_support(rows, weights, intercept)]
    right, weight = np.array([row["right"] for row in rows]), np.array([row["weight"] for row in rows])
    shipped = json.loads(files("hybridreg.verdict").joinpath("confidence.json").read_text())
    stored = continued(shipped, told, right, weight, below)
    return Rule(weights, intercept, Boosted.read(stored), stored)


def predicted(rows: list[Row], rule: Rule) -> Array:
    """Probability of each row under a rule."""
    told = _with_support(rows, rule.weights, rule.intercept)
    return np.array([confidence(evidence, rule.trees) for evidence in told])


def unseen(rows: list[Row], fitted: Callable[[list[Row]], Rule], folds: int = 5) -> Array:
    """Probability of each row under the rule `fitted` to the other pairs."""
    names = sorted({row["pair"] for row in rows})
    fold = dict(zip(names, np.random.default_rng(0).permutation(len(names)) % folds, strict=True))
    its = np.array([fold[row["pair"]] for row in rows])
    p = np.zeros(len(rows))
    for k in range(folds):
        rule = fitted([row for row, f in zip(rows, its, strict=True) if f != k])
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
    parser.add_argument("what", choices=["gather", "fit", "continue", "usual"])
    parser.add_argument("--rows", type=Path, default=Path("runs/evidence.jsonl"))
    parser.add_argument("--pairs", type=int, default=40, help="of each tier")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--below", nargs=2, metavar=("NAME", "BOUND"), help="continue for some answers alone")
    parser.add_argument(
        "--write",
        type=Path,
        help="hybridreg/verdict of a checkout, where the trees are written; the log-odds go to evidence/ beside it",
    )
    parser.add_argument("--picture", type=Path, help="draw the reliability curve of the five folds")
    options = parser.parse_args()
    if options.what == "gather":
        gather(options.rows, options.pairs, options.workers)
        return
    rows = read(options.rows)
    if options.what == "usual":
        found = ranges(rows)
        print(json.dumps(found["facts"], indent=2))
        if options.write:
            write_json(options.write / "usual.json", found)
        return
    fitted: Callable[[list[Row]], Rule] = fit
    if options.what == "continue":
        below = (options.below[0], float(options.below[1])) if options.below else None
        rows = [row for row in rows if below is None or row["evidence"][below[0]] <= below[1]]
        fitted = partial(longer, below=below)
    p = unseen(rows, fitted)
    report(rows, p)
    if options.picture:
        draw(p, np.array([row["right"] for row in rows]), options.picture)
    rule = fitted(rows)
    support = {
        "weights": {k: float(f"{w:.4g}") for k, w in rule.weights.items()},
        "intercept": round(rule.intercept, 3),
    }
    print(json.dumps(support, indent=2))
    if options.write and options.what == "continue":
        (options.write / "confidence.json").write_text(json.dumps(rule.stored_trees) + "\n")
    elif options.write:
        (options.write.parent / "evidence" / "log_odds.json").write_text(json.dumps(support, indent=2) + "\n")
        (options.write / "confidence.json").write_text(json.dumps(rule.stored_trees) + "\n")


if __name__ == "__main__":
    main()
