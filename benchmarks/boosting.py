# SPDX-License-Identifier: MIT
"""Boosted trees by scikit-learn, as plain numbers (`hybridreg.verdict.boosted`)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import HistGradientBoostingClassifier

from hybridreg.verdict.confidence import SPEAKS

# Few and shallow trees, each leaf on some answers: there are hundreds of answers, not thousands.
DEPTH, TREES, RATE, LEAF, RIDGE = 3, 200, 0.05, 12, 1.0


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
