# SPDX-License-Identifier: MIT
"""Boosted trees by scikit-learn, as plain numbers (`hybridreg.verdict.boosted`)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import HistGradientBoostingClassifier

from hybridreg.verdict.boosted import Boosted
from hybridreg.verdict.confidence import SPEAKS

# Few and shallow trees, each leaf on some answers: there are hundreds of answers, not thousands.
DEPTH, TREES, RATE, LEAF, RIDGE = 3, 200, 0.05, 12, 1.0
# Trees that are added to stored ones.
MORE = 60


def boost(
    told: list[dict[str, float]], right: NDArray[np.bool_], weight: NDArray[np.float64]
) -> HistGradientBoostingClassifier:
    """Trees that tell right answers from wrong ones, monotone as `SPEAKS` says."""
    model = HistGradientBoostingClassifier(
        max_depth=DEPTH,
        max_iter=TREES,
        learning_rate=RATE,
        min_samples_leaf=LEAF,
        l2_regularization=RIDGE,
        early_stopping=False,
        monotonic_cst=list(SPEAKS.values()),
        random_state=0,
    )
    return model.fit([[row[name] for name in SPEAKS] for row in told], right, sample_weight=weight)


def plain(model: HistGradientBoostingClassifier) -> dict[str, Any]:
    """A fitted model as numbers; scikit-learn has no public way to its trees."""
    return {
        "names": list(SPEAKS),
        "baseline": float(np.ravel(model._baseline_prediction)[0]),
        "trees": [_tree(predictor.nodes) for (predictor,) in model._predictors],
    }


def _tree(nodes: NDArray[Any]) -> dict[str, list[float]]:
    leaf = nodes["is_leaf"].astype(bool)
    return {
        "feature": np.where(leaf, 0, nodes["feature_idx"]).tolist(),
        "threshold": np.where(leaf, 0.0, nodes["num_threshold"]).tolist(),
        "left": np.where(leaf, -1, nodes["left"].astype(int)).tolist(),
        "right": np.where(leaf, -1, nodes["right"].astype(int)).tolist(),
        "value": [float(f"{x:.6g}") for x in np.where(leaf, nodes["value"], 0.0)],
    }


def continued(
    stored: dict[str, Any],
    told: list[dict[str, float]],
    right: NDArray[np.bool_],
    weight: NDArray[np.float64],
    below: tuple[str, float] | None = None,
) -> dict[str, Any]:
    """Stored trees (`plain`) with more of them behind, fitted to answers that the first ones say too little of.

    What the first ones learned of other answers stays. Newton steps on the log-loss, each a shallow tree, monotone as
    `SPEAKS` says. With `below`, a feature's name and a number, they count where the feature is not above it, and change
    nothing elsewhere.
    """
    from sklearn.tree import DecisionTreeRegressor

    names = list(SPEAKS)
    first = _renamed(stored, names)
    known = Boosted.read(first)
    X = np.array([[row[name] for name in names] for row in told])
    log_odds = np.array([known(row) for row in told])
    trees = []
    for _ in range(MORE):
        p = 1.0 / (1.0 + np.exp(-log_odds))
        slope, curve = right - p, np.maximum(p * (1.0 - p), 1e-3)
        tree = DecisionTreeRegressor(
            max_depth=DEPTH,
            min_samples_leaf=LEAF,
            monotonic_cst=list(SPEAKS.values()),
            random_state=0,
        ).fit(X, slope / curve, sample_weight=weight * curve)
        log_odds = log_odds + RATE * tree.predict(X)
        grown = _plain_tree(tree.tree_)
        trees.append(grown if below is None else _beneath(names.index(below[0]), below[1], grown))
    return {**first, "trees": [*first["trees"], *trees]}


def _renamed(stored: dict[str, Any], names: list[str]) -> dict[str, Any]:
    # The same trees with their questions numbered by `names`.
    row = np.array([names.index(name) for name in stored["names"]])
    trees = [{**tree, "feature": row[tree["feature"]].tolist()} for tree in stored["trees"]]
    return {**stored, "names": names, "trees": trees}


def _beneath(feature: int, threshold: float, tree: dict[str, list[float]]) -> dict[str, list[float]]:
    # A question before the tree's own; who answers no comes to a leaf of zero.
    return {
        "feature": [feature, 0, *tree["feature"]],
        "threshold": [threshold, 0.0, *tree["threshold"]],
        "left": [2, -1, *(node + 2 if node > 0 else -1 for node in tree["left"])],
        "right": [1, -1, *(node + 2 if node > 0 else -1 for node in tree["right"])],
        "value": [0.0, 0.0, *tree["value"]],
    }


def _plain_tree(tree: Any) -> dict[str, list[float]]:
    leaf = tree.children_left < 0
    value = RATE * tree.value[:, 0, 0]
    return {
        "feature": np.where(leaf, 0, tree.feature).tolist(),
        "threshold": np.where(leaf, 0.0, tree.threshold).tolist(),
        "left": np.where(leaf, -1, tree.children_left).tolist(),
        "right": np.where(leaf, -1, tree.children_right).tolist(),
        "value": [float(f"{x:.6g}") for x in np.where(leaf, value, 0.0)],
    }
