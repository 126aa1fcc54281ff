# SPDX-License-Identifier: MIT
"""A batch in a process of its own, killed at random moments and begun again, beside one that nobody disturbed."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hybridreg.eval import store
from hybridreg.io import write_json, write_points
from hybridreg.testing import sample_pair

_TABLE = """
title = "Killed"
protocols = ["cross3dreg", "kitti"]
starts = 1

[[row]]
name = "icp"
match = "none"
estimate = "identity"
refine = "icp"

[[row]]
name = "default"
"""
# Columns of the CSV that tell times and memory, which no two runs share.
_UNSHARED = ("s a pair", "peak MB")
_LONGEST_SECONDS = 600.0


@dataclass
class Story:
    """What happened over all kills.

    Attributes
    ----------
    kills : how often the batch was killed
    kept : rows that a kill found finished, summed over the kills
    began : rows that each start found
    """

    kills: int = 0
    kept: int = 0
    began: list[int] = field(default_factory=list)


def write_data(folder: Path, pairs: int) -> None:
    """A folder of small made pairs."""
    for i in range(pairs):
        pair, T = sample_pair(i, 400)
        place = folder / f"pair-{i}"
        place.mkdir(parents=True)
        write_points(place / "source.ply", pair.source.points)
        write_points(place / "target.ply", pair.target.points)
        write_json(place / "meta.json", {"T_target_source": T})
    (folder.parent / "table.toml").write_text(_TABLE, encoding="utf-8")


def run_whole(root: Path, out: str, workers: int) -> float:
    """The batch without a kill; seconds."""
    start = time.perf_counter()
    done = subprocess.run(_command(out, workers), cwd=root, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return time.perf_counter() - start


def run_killed(root: Path, out: str, *, kills: int, seconds: float, workers: int, seed: int) -> Story:
    """The batch, killed (SIGKILL) at up to `kills` seeded moments of `seconds`, then run to its end.

    After every kill each row that the file held whole before must stand in it unchanged, byte by byte.

    Raises
    ------
    AssertionError
        A row was lost, changed or doubled.
    """
    rng, story = np.random.default_rng(seed), Story()
    folder = root / out / "predictions"
    before: dict[str, list[bytes]] = {}
    for _ in range(kills):
        story.began.append(sum(len(lines) for lines in before.values()))
        process = subprocess.Popen(
            _command(out, workers),
            cwd=root,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        if _killed_after(process, float(rng.uniform(0.0, seconds))):
            story.kills += 1
        after = whole_lines(folder)
        compare(before, after)
        story.kept += sum(len(lines) for lines in after.values())
        before = after
    run_whole(root, out, workers)
    compare(before, whole_lines(folder))
    return story


def whole_lines(folder: Path) -> dict[str, list[bytes]]:
    """Finished lines of every file of predictions, by its name."""
    return {
        file.name: [line for line in file.read_bytes().splitlines(keepends=True) if line.endswith(b"\n")]
        for file in sorted(folder.glob("*.jsonl"))
    }


def compare(before: dict[str, list[bytes]], after: dict[str, list[bytes]]) -> None:
    """Every finished line is still there, at its place, and no pair twice."""
    for name, lines in before.items():
        assert after.get(name, [])[: len(lines)] == lines, f"{name}: finished lines were lost or changed"
    for name, lines in after.items():
        ids = [json.loads(line)["id"] for line in lines[1:]]
        assert len(set(ids)) == len(ids), f"{name}: pairs stand twice"


def same_tables(root: Path, one: str, other: str) -> None:
    """Both runs hold the same rows and print the same tables, times and memory apart."""
    for file in sorted((root / one / "predictions").glob("*.jsonl")):
        ours, theirs = (store.read(root / out / "predictions" / file.name) for out in (one, other))
        assert ours.config == theirs.config, file.name
        assert [row.timeless for row in ours.rows] == [row.timeless for row in theirs.rows], file.name
    ours_table, theirs_table = (_figures(root / out / "table.csv") for out in (one, other))
    assert ours_table == theirs_table
    left = [path.name for path in (root / other).rglob(".*")]
    assert not left, f"left behind: {left}"


def _figures(path: Path) -> list[dict[str, Any]]:
    import csv

    with path.open(encoding="utf-8", newline="") as file:
        return [
            {key: value for key, value in line.items() if key not in _UNSHARED}
            for line in csv.DictReader(file)
        ]


def _command(out: str, workers: int) -> Sequence[str]:
    options = ["--data", "data", "--out", out, "--workers", str(workers)]
    return [sys.executable, "-m", "hybridreg", "table", "table.toml", *options]


def _killed_after(process: subprocess.Popen[bytes], seconds: float) -> bool:
    # The whole group, as a machine that loses its power takes the workers along.
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait(_LONGEST_SECONDS)
        return True
    return False
