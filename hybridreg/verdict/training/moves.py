# SPDX-License-Identifier: MIT
"""What each move of the search brings: `default` with one of them switched off at a time, pair by pair.

    python -m hybridreg.verdict.training.moves --pairs 20 --rows runs/moves.jsonl --table runs/moves.md

Tiers of `sim:val`, the hard kinds with even seeds, and real pairs where they lie beside the checkout; no test pair.
Rows are appended as they are made, so that an interrupted run goes on. Seconds are processor seconds. Where the first
entry is certain, only the moves that it makes are switched off.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple
from unittest import mock

import numpy as np
from numpy.typing import NDArray

from hybridreg import Pipeline
from hybridreg.candidates import candidates
from hybridreg.data import hard, open_dataset
from hybridreg.geometry import se3
from hybridreg.pair import Pair
from hybridreg.search import rivals, settle

Array = NDArray[np.float64]
Row = dict[str, Any]

TIERS = ("near", "mid", "far", "degenerate", "disjoint")
# Hard pairs for each pair of a tier, and the first of their even seeds: below it they took part in fits.
_HARD, _FIRST_SEED = 2, 300
# Degrees and metres within which a pose is right.
_RIGHT_DEG, _RIGHT_METRES = 2.0, 0.5

_settle = settle.settle
# What is put in the place of each move: module, name, replacement.
MOVES: dict[str, tuple[Any, str, Callable[..., Any]] | None] = {
    "none": None,
    "settling": (settle, "settle", lambda views, T, **how: T),
    "settling from afar": (
        settle,
        "settle",
        lambda views, T, **how: _settle(views, T, **{**how, "wide": False}),
    ),
    "GICP": (candidates.Candidates, "_refined", lambda self, scene, one: one),
    "pattern search": (candidates, "_polished", lambda scene, found: found),
    "basin hopping": (candidates, "hop", lambda scene, poses, rng: []),
    "second look": (candidates, "second_look", lambda scene: []),
    "repeats as rivals": (rivals, "copies", lambda views, T, axes: []),
    "half turns as rivals": (rivals, "_turned", lambda own: []),
}
_OF_THE_FIRST = ("none", "settling", "settling from afar", "GICP")


class Case(NamedTuple):
    """A pair, every right pose (none where no pose is right), and the metres within which a pose is right."""

    name: str
    group: str
    pair: Pair
    truths: tuple[Array, ...]
    metres: float


def cases(n: int, real: Path) -> Iterator[Case]:
    """`n` pairs of each tier and their hard ones, in turn; then the real ones."""
    for i in range(n):
        for tier in TIERS:
            labelled = open_dataset(f"sim:val/{tier}")[i]
            truths = () if tier == "disjoint" else (labelled.T_target_source,)
            yield Case(f"{tier}/{i}", tier, labelled.pair, truths, _RIGHT_METRES)
        for k in range(_HARD * i, _HARD * i + _HARD):
            kind = hard.KINDS[k % len(hard.KINDS)]
            one = hard.sample(kind, _FIRST_SEED + 2 * (k // len(hard.KINDS)))
            pair = Pair.of(one.source, one.target, id=one.name)
            yield Case(one.name, "hard", pair, tuple(one.truths), one.metres)
    if real.is_dir():
        for labelled in open_dataset(str(real)):
            yield Case(labelled.pair.id, "real", labelled.pair, (labelled.T_target_source,), _RIGHT_METRES)


def measure(case: Case, without: str) -> Row:
    """One run without a move."""
    pipeline = Pipeline.preset("default")
    switch = MOVES[without]
    start = time.process_time()
    if switch is None:
        result = pipeline.run(case.pair)
    else:
        module, name, instead = switch
        with mock.patch.object(module, name, instead):
            result = pipeline.run(case.pair)
    seconds = time.process_time() - start
    middle = np.median(case.pair.source.points, axis=0)[None] + case.pair.source.offset
    right = any(_is_right(result.transformation, truth, middle, case.metres) for truth in case.truths)
    return {
        "pair": case.name, "group": case.group, "without": without, "seconds": seconds, "right": right,
        "solvable": bool(case.truths), "verdict": result.verdict, "entries": len(result.entries),
    }  # fmt: skip


def _is_right(T: Array, truth: Array, middle: Array, metres: float) -> bool:
    gap = float(np.linalg.norm(se3.apply(T, middle) - se3.apply(truth, middle)))
    return se3.angle_deg((T @ se3.inverse(truth))[:3, :3]) < _RIGHT_DEG and gap < metres


def table(rows: list[Row]) -> str:
    """Markdown: each move, over the pairs on which it was switched off."""
    with_all = {row["pair"]: row for row in rows if row["without"] == "none"}
    lines = [
        "| switched off | pairs | right (with it) | right and ok (with it) | wrong and ok (with it) | seconds per pair "
        "over those with it |",
        "|---|---|---|---|---|---|",
    ]
    for move in list(MOVES)[1:]:
        off = [row for row in rows if row["without"] == move and row["pair"] in with_all]
        on = [with_all[row["pair"]] for row in off]
        if not off:
            continue
        counts = [
            f"{sum(test(row) for row in off)} ({sum(test(row) for row in on)})"
            for test in (_right, lambda r: _right(r) and _ok(r), lambda r: _ok(r) and not _right(r))
        ]
        ratio = sum(row["seconds"] for row in off) / sum(row["seconds"] for row in on)
        lines.append(f"| {move} | {len(off)} | {' | '.join(counts)} | {ratio:.2f} |")
    return "\n".join(lines) + "\n"


def _right(row: Row) -> bool:
    return bool(row["right"])


def _ok(row: Row) -> bool:
    return bool(row["verdict"] == "ok")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--pairs", type=int, default=20, help="of each tier")
    parser.add_argument("--rows", type=Path, default=Path("runs/moves.jsonl"))
    parser.add_argument("--real", type=Path, default=Path("../shared/data/real"))
    parser.add_argument("--table", type=Path)
    options = parser.parse_args()
    rows = (
        [json.loads(line) for line in options.rows.read_text().splitlines()] if options.rows.exists() else []
    )
    held = {(row["pair"], row["without"]) for row in rows}
    options.rows.parent.mkdir(parents=True, exist_ok=True)
    with options.rows.open("a") as file:
        for case in cases(options.pairs, options.real):
            easy = any(r["pair"] == case.name and r["without"] == "none" and r["entries"] == 1 for r in rows)
            for move in MOVES:
                if (case.name, move) in held or (easy and move not in _OF_THE_FIRST):
                    continue
                row = measure(case, move)
                easy |= move == "none" and row["entries"] == 1
                rows.append(row)
                file.write(json.dumps(row) + "\n")
                file.flush()
    print(table(rows))
    if options.table:
        options.table.write_text(table(rows))


if __name__ == "__main__":
    main()
