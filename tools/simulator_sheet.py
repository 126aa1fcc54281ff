# SPDX-License-Identifier: MIT
"""Contact sheet of simulated pairs: both clouds from above at the true pose, and the camera image.

python -m tools.simulator_sheet docs/simulator.png
"""

from __future__ import annotations

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from hybridreg.data import simulate
from hybridreg.data.simulate.sensing.overlaps import thin
from hybridreg.geometry import se3

TIERS = ("near", "near", "mid", "mid", "mid", "far", "far", "far", "degenerate", "disjoint")


def draw_pair(axes: np.ndarray, tier: str, index: int, seed: int) -> None:
    """One column: bird's-eye view above, camera image below."""
    sample = simulate.pair(tier, seed=seed, index=index, split="val")
    T = sample.T_target_source
    source = (
        se3.apply(T, thin(sample.pair.source.points, 0.15))
        if tier != "disjoint"
        else sample.pair.source.points
    )
    target = thin(sample.pair.target.points, 0.15)
    top, bottom = axes
    top.scatter(target[:, 0], target[:, 1], s=0.25, c="#2b6cb0", lw=0, alpha=0.5)
    top.scatter(source[:, 0], source[:, 1], s=0.25, c="#dd6b20", lw=0, alpha=0.5)
    top.plot(0, 0, "^", c="#1a365d", ms=4)
    if tier != "disjoint":
        top.plot(T[0, 3], T[1, 3], "^", c="#7b341e", ms=4)
    top.set(xlim=(-55, 55), ylim=(-55, 55), xticks=[], yticks=[], aspect="equal")
    top.set_title(
        f"{tier}, {sample.pair.meta['scene']}\n{sample.pair.source.sensor} → {sample.pair.target.sensor}, "
        f"overlap {sample.overlap:.2f}",
        fontsize=6,
    )
    bottom.imshow(sample.pair.image)
    bottom.axis("off")


def main() -> None:
    """Five pairs across, two rows of them."""
    out, seed = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 1
    figure, axes = plt.subplots(4, 5, figsize=(15, 11), height_ratios=[1.75, 1, 1.75, 1])
    for k, tier in enumerate(TIERS):
        row, column = divmod(k, 5)
        draw_pair(axes[2 * row : 2 * row + 2, column], tier, k, seed)
    figure.subplots_adjust(0.005, 0.005, 0.995, 0.965, 0.02, 0.06)
    figure.savefig(out, dpi=100, pil_kwargs={"optimize": True})


if __name__ == "__main__":
    main()
