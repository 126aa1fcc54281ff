# SPDX-License-Identifier: MIT
"""Does the verdict's confidence keep its word? Brier score and reliability curve of runs that were made already.

    python -m hybridreg.verdict.training.calibration runs/default-* \
        --picture docs/reliability.png --table runs/calibration.md

Each folder is one that `hybridreg table` wrote. A pose is right within 2 degrees and 0.5 m; on disjoint pairs, which
have no pose, none is. Writes the picture, and a Markdown table with one line for each folder.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hybridreg.eval.run import store
from hybridreg.eval.run.row import Row
from hybridreg.eval.score import metrics
from hybridreg.evidence.log_odds import OK

Array = NDArray[np.float64]
# Borders of the curve's bins: few answers lie in the middle, and "ok" has one of its own.
_BINS = (0.0, 0.05, 0.25, 0.5, 0.75, OK, 1.0)


def outcomes(folder: Path) -> tuple[Array, NDArray[np.bool_]]:
    """Confidence (n,) of every run in a folder, and whether its pose is right (n,)."""
    told = answered(folder)
    return np.array([row.confidence for row in told], dtype=np.float64), np.array([is_right(r) for r in told])


def answered(folder: Path) -> list[Row]:
    """The runs in a folder that have a verdict."""
    rows = [row for file in sorted((folder / "predictions").glob("*.jsonl")) for row in store.read(file).rows]
    return [row for row in rows if row.confidence is not None]


def is_right(row: Row) -> bool:
    """Whether the pose of a run is within 2 degrees and 0.5 m; on disjoint pairs none is."""
    if row.T is None or row.T_true is None or "/disjoint/" in row.id:
        return False
    T, truth = np.array(row.T), np.array(row.T_true)
    return metrics.rre_deg(T, truth) < 2.0 and metrics.rte_m(T, truth) < 0.5


def line(name: str, p: Array, right: NDArray[np.bool_]) -> str:
    """One line of the table."""
    ok = p >= OK
    return (
        f"| {name} | {len(p)} | {right.sum()} | {np.sum(ok & right)} | {np.sum(ok & ~right)} "
        f"| {np.mean((p - right) ** 2):.3f} |"
    )


def draw(p: Array, right: NDArray[np.bool_], path: Path) -> None:
    """Share of right poses against the mean confidence of each bin, with 95 % intervals (Wilson) and counts."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(5.0, 4.6))
    axes.plot([0, 1], [0, 1], color="0.7", linewidth=1)
    which = np.clip(np.searchsorted(_BINS, p, side="right") - 1, 0, len(_BINS) - 2)
    for k in np.unique(which):
        n, hits = int(np.sum(which == k)), int(right[which == k].sum())
        low, high = wilson(hits, n)
        at, share = float(p[which == k].mean()), hits / n
        axes.errorbar(at, share, [[share - low], [high - share]], fmt="o", color="tab:blue", capsize=3)
        axes.annotate(f"{hits}/{n}", (at, share), xytext=(7, -4), textcoords="offset points", fontsize=8)
    axes.axvline(OK, color="tab:green", linestyle=":", linewidth=1)
    axes.text(OK - 0.01, 0.02, '"ok"', ha="right", color="tab:green", fontsize=8)
    axes.set(xlabel="confidence", ylabel="share of right poses", xlim=(-0.03, 1.2), ylim=(-0.03, 1.05))
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)


def wilson(hits: int, n: int) -> tuple[float, float]:
    """95 % interval of a share."""
    z2 = 1.96**2
    middle = (hits + z2 / 2) / (n + z2)
    half = 1.96 * np.sqrt(max(hits * (n - hits) / n + z2 / 4, 0.0)) / (n + z2)
    share = hits / n
    return min(share, float(middle - half)), max(share, float(middle + half))


def table(folders: Sequence[Path]) -> tuple[str, Array, NDArray[np.bool_]]:
    """Markdown for each folder and all of them, with every confidence and whether its pose is right."""
    found = {folder.name.removeprefix("default-"): outcomes(folder) for folder in folders}
    p = np.concatenate([one for one, _ in found.values()])
    right = np.concatenate([one for _, one in found.values()])
    lines = [
        '| runs | answers | right | right and "ok" | wrong but "ok" | Brier score |',
        "|---|---|---|---|---|---|",
    ]
    lines += [line(name, *each) for name, each in found.items()]
    return "\n".join([*lines, line("all", p, right)]), p, right


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--table", type=Path)
    options = parser.parse_args()
    text, p, right = table(options.folders)
    print(text)
    if options.table:
        options.table.write_text(text + "\n")
    if options.picture:
        draw(p, right, options.picture)


if __name__ == "__main__":
    main()
