# SPDX-License-Identifier: MIT
"""What each move of the search brings: `default` with one of them switched off at a time, pair by pair.

    python -m hybridreg.verdict.training.moves --pairs 20 --rows runs/moves.jsonl --table runs/moves.md

Tiers of `sim:val`, the hard kinds with even seeds, and real pairs where they lie beside the checkout; no test pair.
The rows of a pair are appended together, so that an interrupted run goes on; other `--moves` need other `--rows`.
Seconds are processor seconds. Where the first entry is certain, only the moves that it makes are switched off.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple
from unittest import mock

from hybridreg import Pipeline, registry
from hybridreg.candidates import candidates
from hybridreg.classical.overhead import birdseye
from hybridreg.data import hard, open_dataset
from hybridreg.data.hard.true_poses import Sample, is_right
from hybridreg.pair import LabelledPair, Pair
from hybridreg.search import rivals, settle
from hybridreg.verdict.training.answers import Row, read

TIERS = ("near", "mid", "far", "degenerate", "disjoint")
GROUPS = (*TIERS, "hard", "real")
# Hard pairs for each pair of a tier, and the first of their even seeds: below it they took part in fits.
_HARD, _FIRST_SEED = 2, 300

_settle = settle.settle
# The entries of `default` by what else a user would call them: left out one at a time.
ENTRIES = {"Manhattan": "manhattan", "KISS-Matcher": "kiss", "relief": "relief", "learned entry": "ransac"}
# What is put in the place of each other move: module or class, name, replacement.
PATCHES: dict[str, tuple[Any, str, Any]] = {
    "settling": (settle, "settle", lambda views, T, **how: T),
    "settling from afar": (
        settle,
        "settle",
        lambda views, T, **how: _settle(views, T, **{**how, "wide": False}),
    ),
    "GICP": (candidates.Candidates, "_refined", lambda self, scene, one: one),
    "second spectrum": (birdseye, "_LEVELLED", birdseye._LEVELLED[:1]),
    "sliding along a street": (birdseye.BirdsEye, "_slid", lambda self, source, target, voxel: []),
    "bird's-eye by sensors": (birdseye, "_leans", lambda own: False),
    "second look": (candidates, "second_look", lambda scene: []),
    "repeats as rivals": (rivals, "copies", lambda views, T, axes: []),
    "turns as rivals": (rivals, "_turned", lambda own: []),
}
NONE = "none"
MOVES = (NONE, *PATCHES, *ENTRIES)
# Those that a pair is spared which the first entry answers beyond doubt.
_OF_LATER = ("second look", *ENTRIES)


# A group, or the folder of real pairs, and which of its pairs.
Job = tuple[str, int]


class Case(NamedTuple):
    """A pair of a group, and which poses are right."""

    group: str
    pair: Pair
    sample: Sample


def jobs(n: int, real: Path) -> list[Job]:
    """`n` pairs of each tier and their hard ones, in turn; then the real ones."""
    some = [
        job
        for i in range(n)
        for job in [*((tier, i) for tier in TIERS), *(("hard", _HARD * i + k) for k in range(_HARD))]
    ]
    return some + [(str(real), i) for i in range(len(open_dataset(str(real))) if real.is_dir() else 0)]


def case(job: Job) -> Case:
    """The pair of a job."""
    group, i = job
    if group == "hard":
        one = hard.sample(hard.KINDS[i % len(hard.KINDS)], _FIRST_SEED + 2 * (i // len(hard.KINDS)))
        return Case(group, Pair.of(one.source, one.target, id=one.name), one)
    if group in TIERS:
        return _labelled(group, open_dataset(f"sim:val/{group}")[i])
    return _labelled("real", open_dataset(group)[i])


def _labelled(group: str, labelled: LabelledPair) -> Case:
    return Case(group, labelled.pair, Sample.of(labelled, group, hopeless=group == "disjoint"))


def measure(case: Case, without: str) -> Row:
    """One run without a move."""
    pipeline = Pipeline.preset("default")
    if without in ENTRIES:
        pipeline = without_entry(pipeline, ENTRIES[without])
    start = time.process_time()
    with mock.patch.object(*PATCHES[without]) if without in PATCHES else nullcontext():
        result = pipeline.run(case.pair)
    return {
        "pair": case.pair.id, "group": case.group, "without": without, "seconds": time.process_time() - start,
        "right": is_right(case.sample, result.transformation), "verdict": result.verdict,
        "entries": len(result.entries),
    }  # fmt: skip


def without_entry(pipeline: Pipeline, estimate: str) -> Pipeline:
    several = pipeline.estimate
    others = tuple(
        entry for entry in several.of if registry.name_of(entry["estimate"]) != f"estimate.{estimate}"
    )
    assert len(others) == len(several.of) - 1, (
        f"{estimate}: {len(several.of) - len(others)} entries of this name"
    )
    return replace(pipeline, estimate=replace(several, of=others))


def measured(job: Job, moves: Sequence[str] = MOVES[1:]) -> list[Row]:
    """Rows of a pair, without each of the moves in turn."""
    one = case(job)
    measure(one, NONE)  # the first run of a pair also fills caches
    rows = [{**measure(one, NONE), "job": job}]
    easy = rows[0]["entries"] == 1
    return rows + [measure(one, move) for move in moves if not (easy and move in _OF_LATER)]


def table(rows: list[Row]) -> str:
    """Markdown: each move, over the pairs on which it was switched off."""
    with_all = {row["pair"]: row for row in rows if row["without"] == "none"}
    lines = [
        "| switched off | pairs | right (with it) | right and ok (with it) | wrong and ok (with it) | seconds per pair "
        "over those with it |",
        "|---|---|---|---|---|---|",
    ]
    for move in MOVES[1:]:
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
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--real", type=Path, default=Path("../shared/data/real"))
    parser.add_argument("--table", type=Path)
    parser.add_argument("--groups", nargs="+", choices=GROUPS, default=GROUPS, metavar="NAME")
    parser.add_argument("--moves", nargs="+", choices=MOVES[1:], default=MOVES[1:], metavar="NAME")
    options = parser.parse_args()
    rows = read(options.rows)
    held = {tuple(row["job"]) for row in rows if "job" in row}
    options.rows.parent.mkdir(parents=True, exist_ok=True)
    wanted = {str(options.real) if group == "real" else group for group in options.groups}
    todo = [job for job in jobs(options.pairs, options.real) if job not in held and job[0] in wanted]
    with ProcessPoolExecutor(options.workers) as pool, options.rows.open("a") as file:
        for made in pool.map(partial(measured, moves=options.moves), todo):
            rows.extend(made)
            file.write("".join(json.dumps(row) + "\n" for row in made))
            file.flush()
    print(table(rows))
    if options.table:
        options.table.write_text(table(rows))


if __name__ == "__main__":
    main()
