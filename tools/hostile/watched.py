# SPDX-License-Identifier: MIT
"""A process that tries cases one after another, watched from outside: it may crash, hang or exhaust the memory."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Literal

from tools.hostile.case import Case, verdict_on

_START_SECONDS = 300.0
_MOST_MEMORY = 8 * 2**30  # bytes of address space beyond what the imports took


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """The outcome of a case."""

    word: Literal["fine", "refused", "finding"]
    text: str
    seconds: float


class Watched:
    """Runs cases in a child process; a child that dies or exceeds `limit` seconds is a finding, and is replaced."""

    def __init__(self, limit: float = 30.0) -> None:
        self.limit = limit
        self._start()

    def run(self, case: Case) -> Outcome:
        """The outcome of a case."""
        start = time.perf_counter()
        self._pipe.send(case)
        try:
            if not self._pipe.poll(self.limit):
                return self._finding(f"hang: no answer within {self.limit:g} s", start)
            word, text = self._pipe.recv()
        except (EOFError, ConnectionResetError):
            self._process.join()
            return self._finding(f"crash: {_cause(self._process.exitcode)}", start)
        return Outcome(word=word, text=text, seconds=time.perf_counter() - start)

    def close(self) -> None:
        """End the child."""
        self._process.kill()
        self._process.join()
        self._pipe.close()

    def __enter__(self) -> Watched:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()
        if not self._pipe.poll(_START_SECONDS):
            raise RuntimeError(f"the child did not start within {_START_SECONDS:g} s")
        self._pipe.recv()

    def _finding(self, text: str, start: float) -> Outcome:
        seconds = time.perf_counter() - start
        self.close()
        self._start()
        return Outcome(word="finding", text=text, seconds=seconds)


def _serve(pipe: Connection) -> None:
    # What a child prints is output of other libraries; its results go through the pipe.
    devnull = os.open(os.devnull, os.O_WRONLY)
    os.dup2(devnull, 1)
    os.dup2(devnull, 2)
    _import_everything()
    _limit_memory()
    pipe.send("ready")
    while True:
        try:
            case = pipe.recv()
        except EOFError:
            return
        pipe.send(verdict_on(case))


def _import_everything() -> None:
    # Seconds that would otherwise count against the first case that needs them.
    from hybridreg import registry

    for name in registry.BUILT_IN:
        registry.load(*name.split(".", 1))
    for module in ("torch", "open3d", "small_gicp", "kiss_matcher", "cv2", "laspy"):
        try:
            __import__(module)
        except ImportError:
            continue


def _limit_memory() -> None:
    # So that an absurd allocation is a MemoryError here and does not end something else on the machine.
    if sys.platform != "linux":
        return
    import resource
    from pathlib import Path

    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + _MOST_MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def _cause(code: int | None) -> str:
    if code is not None and code < 0:
        return f"signal {signal.Signals(-code).name}"
    return f"exit code {code}"
