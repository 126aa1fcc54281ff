# SPDX-License-Identifier: MIT
"""Two batches started at once in one folder, and killed at random moments: one writes, the other is refused."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tools.hostile import killed_batch as killed

_REFUSED = "is being written by"
_LONGEST_SECONDS = 600.0


@dataclass
class Meetings:
    """The result over all rounds.

    Attributes
    ----------
    refused : batches that were refused with the writer's name
    finished : batches that finished
    killed : batches that were killed
    """

    refused: int = 0
    finished: int = 0
    killed: int = 0


def run_two(root: Path, out: str, *, rounds: int, workers: int, seed: int) -> Meetings:
    """Two batches at once, repeatedly; the writer is killed, and in the end one is run alone.

    After every round all complete rows are unchanged, no file holds a pair twice or a partial line in its middle, and
    the other batch was refused with one sentence. A round in which a batch finished may refuse none.

    Raises
    ------
    AssertionError
        A row was lost, changed or doubled; both wrote; a refusal was something else.
    """
    rng, met = np.random.default_rng(seed), Meetings()
    folder = root / out / "predictions"
    for _ in range(rounds):
        before = killed.whole_lines(folder)
        pair = [_begun(root, out, workers, overwrite=False) for _ in range(2)]
        _met(pair)
        texts = [_ended(process, float(rng.uniform(0.5, 4.0))) for process in pair]
        for process, text in zip(pair, texts, strict=True):
            if process.returncode == 2:
                assert _REFUSED in text, text
                assert text.count("\n") == 1, text
            met.refused += process.returncode == 2
            met.finished += process.returncode == 0
            met.killed += process.returncode == -signal.SIGKILL
            assert process.returncode in (0, 2, -signal.SIGKILL), text
        wrote = [process.returncode != 2 for process in pair]
        assert sum(wrote) == 1 or 0 in [process.returncode for process in pair], "both wrote, or neither"
        killed.compare(before, killed.whole_lines(folder))
    killed.run_whole(root, out, workers)
    return met


def _met(pair: Sequence[subprocess.Popen[str]]) -> None:
    # Until one of them ended, as a refused one does: starting takes a while on a busy machine.
    deadline = time.monotonic() + _LONGEST_SECONDS
    while all(process.poll() is None for process in pair) and time.monotonic() < deadline:
        time.sleep(0.05)


def overwrite_is_refused(root: Path, out: str, workers: int) -> None:
    """``--overwrite`` during a running batch is refused, without affecting that one; `out` must not be there yet.

    Raises
    ------
    AssertionError
        It was not refused, or a row of the running one was lost.
    """
    first = _begun(root, out, workers, overwrite=True)
    folder = root / out / "predictions"
    killed.wait_for_rows(first, folder, 1)
    before = killed.whole_lines(folder)
    second = _begun(root, out, workers, overwrite=True)
    text = _ended(second, _LONGEST_SECONDS)
    was_running = first.poll() is None
    assert second.returncode == 2 or not was_running, "the running batch was overwritten"
    assert _REFUSED in text or not was_running, text
    if was_running:
        killed.compare(before, killed.whole_lines(folder))
    _ended(first, _LONGEST_SECONDS)
    assert first.returncode == 0


def _begun(root: Path, out: str, workers: int, *, overwrite: bool) -> subprocess.Popen[str]:
    command = [*killed.command(out, workers), *(["--overwrite"] if overwrite else [])]
    return subprocess.Popen(
        command,
        cwd=root,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def _ended(process: subprocess.Popen[str], seconds: float) -> str:
    # Its stderr; killed with its workers where it takes longer.
    try:
        return process.communicate(timeout=seconds)[1]
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        return process.communicate(timeout=_LONGEST_SECONDS)[1]
