# SPDX-License-Identifier: MIT
"""Graceful stop: after the first SIGINT or SIGTERM the step finishes and a checkpoint is written."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


class StopFlag:
    """Whether the process was asked to stop, and by which signal."""

    def __init__(self) -> None:
        self.asked, self.number = False, 0

    def __call__(self, number: int = 0, *_: object) -> None:
        if self.asked:  # asked twice: stop at once
            raise KeyboardInterrupt
        self.asked, self.number = True, number


@contextmanager
def stop_on_signals(flag: StopFlag | None = None) -> Iterator[StopFlag]:
    """Catch SIGINT, SIGTERM and SIGHUP within the block, where they are not ignored; only the main thread can."""
    flag = flag or StopFlag()
    if threading.current_thread() is not threading.main_thread():
        yield flag
        return
    caught = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    heard = [number for number in caught if signal.getsignal(number) is not signal.SIG_IGN]
    before = {number: signal.signal(number, flag) for number in heard}
    try:
        yield flag
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
