# SPDX-License-Identifier: MIT
"""Boosted trees as plain numbers: a file of them cannot run code."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Boosted:
    """A sum of regression trees.

    Attributes
    ----------
    names : what each column of the features is
    baseline : the sum without any tree
    feature, left, right : (trees, nodes) int64
        Column asked at a node, and the nodes to go to; a leaf goes to itself.
    threshold, value : (trees, nodes) float64
        Go left where the feature is not above the threshold; what a leaf adds.
    depth : questions on the longest way from root to leaf
    """

    names: tuple[str, ...]
    baseline: float
    feature: Indices
    threshold: Array
    left: Indices
    right: Indices
    value: Array
    depth: int

    @classmethod
    def of(
        cls, names: Sequence[str], baseline: float, trees: Sequence[Mapping[str, Sequence[Any]]]
    ) -> Boosted:
        """From trees of unlike size, each with columns `feature`, `threshold`, `left`, `right`, `value`; a leaf has
        -1 for left and right."""
        most = max(len(tree["value"]) for tree in trees)
        rows = np.arange(most)

        def table(column: str, dtype: type) -> NDArray[Any]:
            padded: NDArray[Any] = np.zeros((len(trees), most), dtype=dtype)
            for k, tree in enumerate(trees):
                padded[k, : len(tree[column])] = tree[column]
            return padded

        left, right = (table(side, np.int64) for side in ("left", "right"))
        return cls(
            names=tuple(names),
            baseline=baseline,
            feature=table("feature", np.int64),
            threshold=table("threshold", np.float64),
            left=np.where(left > 0, left, rows),
            right=np.where(right > 0, right, rows),
            value=table("value", np.float64),
            depth=max(_depth(tree) for tree in trees),
        )

    @classmethod
    def read(cls, stored: Mapping[str, Any]) -> Boosted:
        """From a JSON table with `names`, `baseline` and `trees`."""
        return cls.of(stored["names"], stored["baseline"], stored["trees"])

    def __call__(self, features: Mapping[str, float]) -> float:
        """The sum for features by name; others than `names` are not looked at."""
        x = np.array([features[name] for name in self.names])
        trees = np.arange(len(self.value))
        node = np.zeros(len(trees), dtype=np.int64)
        for _ in range(self.depth):
            goes_left = x[self.feature[trees, node]] <= self.threshold[trees, node]
            node = np.where(goes_left, self.left[trees, node], self.right[trees, node])
        return self.baseline + float(self.value[trees, node].sum())


def _depth(tree: Mapping[str, Sequence[Any]], node: int = 0) -> int:
    left, right = int(tree["left"][node]), int(tree["right"][node])
    return 0 if left <= 0 else 1 + max(_depth(tree, left), _depth(tree, right))
