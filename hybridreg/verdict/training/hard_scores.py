# SPDX-License-Identifier: MIT
"""What `register` says of the hard kinds.

    python -m hybridreg.verdict.training.hard_scores --seeds 101,103 --workers 2

Odd seeds take no part in any fit. Prints one line a kind and appends one JSON line a pair to `--out`.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

import hybridreg as hr
from hybridreg.data.hard import KINDS, sample
from hybridreg.data.hard.true_poses import error, is_right

Row = dict[str, Any]


def run(job: tuple[str, int]) -> Row:
    """Verdict on one pair, and whether its pose is right."""
    one = sample(*job)
    start = time.perf_counter()
    try:
        result = hr.register(one.source, one.target)
    except Exception as fault:  # a pair that is refused is a row too
        return {"kind": one.kind, "name": one.name, "solvable": one.solvable, "fault": f"{fault!r}"}
    seconds = time.perf_counter() - start
    T = result.transformation
    right = is_right(one, T)
    # Every true copy that is not the answer stands among the rivals.
    told = all(
        any(is_right(_only(one, k), pose) for pose in (T, *result.rivals)) for k in range(len(one.truths))
    )
    return {
        "kind": one.kind,
        "name": one.name,
        "solvable": one.solvable,
        "right": right,
        "copies_told": told,
        "verdict": result.verdict,
        "confidence": result.confidence,
        "error": list(error(one, T)),
        "cure": one.cure,
        "reasons": list(result.reasons),
        "seconds": seconds,
    }


def _only(one: Any, k: int) -> Any:
    from dataclasses import replace

    return replace(one, truths=(one.truths[k],))


def table(rows: Sequence[Row]) -> str:
    """Markdown, a line for each kind and one for all."""
    lines = [
        '| kind | pairs | solvable | right of these | right called "failed" | wrong called "ok" | refused | median s |',
        "|---|---|---|---|---|---|---|---|",
    ]
    kinds = list(dict.fromkeys(row["kind"] for row in rows))
    for name, some in [*((k, [r for r in rows if r["kind"] == k]) for k in kinds), ("all", list(rows))]:
        told = [row for row in some if "fault" not in row]
        solvable = [row for row in some if row["solvable"]]
        right = [row for row in told if row["right"]]
        seconds = float(np.median([row["seconds"] for row in told])) if told else 0.0
        lines.append(
            f"| {name} | {len(some)} | {len(solvable)} | {sum(row.get('right', False) for row in solvable)} "
            f"| {sum(row['verdict'] == 'failed' for row in right)} of {len(right)} "
            f"| {sum(row['verdict'] == 'ok' and not row['right'] for row in told)} "
            f"| {len(some) - len(told)} | {seconds:.1f} |"
        )
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", default="101,103,105,107,109", help="odd numbers, with commas between")
    parser.add_argument("--kinds", nargs="*", default=KINDS, choices=KINDS, metavar="KIND")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("runs/hard.jsonl"))
    options = parser.parse_args()
    jobs = [(kind, int(seed)) for seed in options.seeds.split(",") for kind in options.kinds]
    options.out.parent.mkdir(parents=True, exist_ok=True)
    rows = []
    with ProcessPoolExecutor(options.workers) as pool, options.out.open("w") as file:
        for row in pool.map(run, jobs):
            rows.append(row)
            file.write(json.dumps(row) + "\n")
            file.flush()
    print(table(sorted(rows, key=lambda row: KINDS.index(row["kind"]))))
    for row in rows:
        if row.get("verdict") == "ok" and not row["right"]:
            print(f"wrong but ok: {row['name']} {row['confidence']:.3f} {row['error']}")


if __name__ == "__main__":
    main()
