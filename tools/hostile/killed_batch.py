# SPDX-License-Identifier: MIT
"""A batch in its own process, killed at random moments and restarted, compared with an undisturbed one."""

from __future__ import annotations

import csv
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

from hybridreg.eval.run import store
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
# Prefixes of the CSV's columns for times and memory, which differ between runs.
_UNSHARED = ("seconds", "peak_memory")
_LONGEST_SECONDS = 600.0


@dataclass
class Story:
    """What happened over all kills.

    Attributes
    ----------
    kills : how often the batch was killed
    began : rows that each start found
    """

    kills: int = 0
    began: list[int] = field(default_factory=list)


def write_data(folder: Path, pairs: int) -> None:
    """A folder of small synthetic pairs."""
    for i in range(pairs):
        pair, T = sample_pair(i, 400)
        place = folder / f"pair-{i}"
        place.mkdir(parents=True)
        write_points(place / "source.ply", pair.source.points)
        write_points(place / "target.ply", pair.target.points)
        write_json(place / "meta.json", {"T_target_source": T})
    (folder.parent / "table.toml").write_text(_TABLE, encoding="utf-8")


def run_whole(root: Path, out: str, workers: int) -> float:
    """The batch without a kill; returns seconds."""
    start = time.perf_counter()
    done = subprocess.run(command(out, workers), cwd=root, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return time.perf_counter() - start


def run_killed(root: Path, out: str, *, kills: int, whole: str, workers: int, seed: int) -> Story:
    """The batch, killed (SIGKILL) at `kills` seeded moments, then run to its end.

    A moment is given by rows and not by the clock, so that a busy machine does not move all of them into the imports:
    after a number of new rows, plus a fraction of a row's time. With no row left it falls into the writing of the
    reports.
    After every kill each complete row of the file must still be there, byte by byte.

    Parameters
    ----------
    whole : the folder of the undisturbed run

    Raises
    ------
    AssertionError
        A row was lost, changed or doubled.
    """
    rng, story = np.random.default_rng(seed), Story()
    total, row_seconds = _rows_of(root / whole)
    folder = root / out / "predictions"
    before: dict[str, list[bytes]] = {}
    while story.kills < kills:
        had = _count(before)
        story.began.append(had)
        ahead = min(int(rng.integers(0, 2 * total // kills + 2)), total - had)
        process = subprocess.Popen(
            command(out, workers),
            cwd=root,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        wait_for_rows(process, folder, had + ahead)
        story.kills += _killed_after(process, float(rng.uniform(0.0, 2.0 * row_seconds)))
        after = whole_lines(folder)
        compare(before, after)
        before = after
    run_whole(root, out, workers)
    compare(before, whole_lines(folder))
    return story


def _rows_of(folder: Path) -> tuple[int, float]:
    rows = [row for file in (folder / "predictions").glob("*.jsonl") for row in store.read(file).rows]
    return len(rows), float(np.mean([row.seconds["total"] for row in rows]))


def _count(lines: dict[str, list[bytes]]) -> int:
    return sum(len(each) - 1 for each in lines.values() if each)


def wait_for_rows(process: subprocess.Popen[Any], folder: Path, rows: int) -> None:
    """Return when the files hold this many rows, or the process has ended."""
    while process.poll() is None and _count(whole_lines(folder)) < rows:
        time.sleep(0.01)


def whole_lines(folder: Path) -> dict[str, list[bytes]]:
    """Finished lines of every file of predictions, by its name."""
    return {
        file.name: [line for line in file.read_bytes().splitlines(keepends=True) if line.endswith(b"\n")]
        for file in sorted(folder.glob("*.jsonl"))
    }


def compare(before: dict[str, list[bytes]], after: dict[str, list[bytes]]) -> None:
    """Every finished line is still there, in its position, and no pair twice."""
    for name, lines in before.items():
        assert after.get(name, [])[: len(lines)] == lines, f"{name}: finished lines were lost or changed"
    for name, lines in after.items():
        ids = [json.loads(line)["id"] for line in lines[1:]]
        assert len(set(ids)) == len(ids), f"{name}: pairs occur twice"


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
    with path.open(encoding="utf-8", newline="") as file:
        lines = list(csv.DictReader(file))
    return [{key: text for key, text in line.items() if not key.startswith(_UNSHARED)} for line in lines]


def command(out: str, workers: int) -> Sequence[str]:
    """The batch as a command, to be run in its root."""
    options = ["--data", "data", "--out", out, "--workers", str(workers)]
    return [sys.executable, "-m", "hybridreg", "table", "table.toml", *options]


def _killed_after(process: subprocess.Popen[bytes], seconds: float) -> bool:
    # The whole group, as in a power failure of the machine.
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait(_LONGEST_SECONDS)
        return True
    return False
