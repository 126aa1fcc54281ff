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
from contextlib import nullcontext
from pathlib import Path
from typing import Any, NamedTuple
from unittest import mock

from hybridreg import Pipeline
from hybridreg.candidates import candidates
from hybridreg.data import hard, open_dataset
from hybridreg.data.hard.true_poses import Sample, is_right
from hybridreg.pair import LabelledPair, Pair
from hybridreg.search import rivals, settle
from hybridreg.verdict.training.answers import Row, read

TIERS = ("near", "mid", "far", "degenerate", "disjoint")
# Hard pairs for each pair of a tier, and the first of their even seeds: below it they took part in fits.
_HARD, _FIRST_SEED = 2, 300
# Metres within which a pose of simulated and real pairs is right.
_RIGHT_METRES = 0.5

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
    """A pair of a group, and which poses are right."""

    group: str
    pair: Pair
    sample: Sample


def cases(n: int, real: Path) -> Iterator[Case]:
    """`n` pairs of each tier and their hard ones, in turn; then the real ones."""
    for i in range(n):
        for tier in TIERS:
            yield _labelled(tier, open_dataset(f"sim:val/{tier}")[i])
        for k in range(_HARD * i, _HARD * i + _HARD):
            one = hard.sample(hard.KINDS[k % len(hard.KINDS)], _FIRST_SEED + 2 * (k // len(hard.KINDS)))
            yield Case("hard", Pair.of(one.source, one.target, id=one.name), one)
    if real.is_dir():
        for labelled in open_dataset(str(real)):
            yield _labelled("real", labelled)


def _labelled(group: str, labelled: LabelledPair) -> Case:
    pair = labelled.pair
    source, target = (cloud.points + cloud.offset for cloud in (pair.source, pair.target))
    truths = () if group == "disjoint" else (labelled.T_target_source,)
    sample = Sample(
        kind=group, name=pair.id, source=source, target=target, truths=truths, metres=_RIGHT_METRES,
        solvable=bool(truths),
    )  # fmt: skip
    return Case(group, pair, sample)


def measure(case: Case, without: str) -> Row:
    """One run without a move."""
    pipeline = Pipeline.preset("default")
    switch = MOVES[without]
    start = time.process_time()
    with mock.patch.object(*switch) if switch else nullcontext():
        result = pipeline.run(case.pair)
    return {
        "pair": case.pair.id, "group": case.group, "without": without, "seconds": time.process_time() - start,
        "right": is_right(case.sample, result.transformation), "verdict": result.verdict,
        "entries": len(result.entries),
    }  # fmt: skip


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
    rows = read(options.rows)
    held = {(row["pair"], row["without"]) for row in rows}
    options.rows.parent.mkdir(parents=True, exist_ok=True)
    with options.rows.open("a") as file:
        for case in cases(options.pairs, options.real):
            easy = any(
                r["pair"] == case.pair.id and r["without"] == "none" and r["entries"] == 1 for r in rows
            )
            for move in MOVES:
                if (case.pair.id, move) in held or (easy and move not in _OF_THE_FIRST):
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
