# SPDX-License-Identifier: MIT
"""SIGINT, SIGTERM and SIGHUP end a command as Ctrl-C does: finished work is kept, and a line says how to continue."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

_SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")


class Stopped(KeyboardInterrupt):
    """The process was asked to end by a signal."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


@contextmanager
def stoppable() -> Iterator[None]:
    """Turn the first signal into `Stopped`; the second ends the process at once.

    A signal that is ignored (`nohup`, a shell's `&`) or handled elsewhere is left alone. While a library computes,
    Python receives no signal until it returns, a second or two.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {}
    for name in _SIGNALS:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
            before[number] = signal.signal(number, _stop)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _stop(number: int, _: FrameType | None) -> None:
    for name in _SIGNALS:
        other = getattr(signal, name, None)
        if other is not None and signal.getsignal(other) is _stop:
            signal.signal(other, _at_once)
    raise Stopped(number)


def _at_once(number: int, _: FrameType | None) -> None:
    os._exit(128 + number)


@contextmanager
def going_on(how: Callable[[], str]) -> Iterator[None]:
    """Have the message of a block that is stopped say what is kept and how to continue."""
    try:
        yield
    except KeyboardInterrupt as error:
        error.how = how()  # type: ignore[attr-defined]
        raise


def how_of(error: KeyboardInterrupt) -> str:
    """What `going_on` noted, as the end of a line."""
    how = getattr(error, "how", "")
    return how and f"; {how}"


def name_of(error: KeyboardInterrupt) -> str:
    """The signal behind it."""
    return signal.Signals(number_of(error)).name


def number_of(error: KeyboardInterrupt) -> int:
    """The signal behind it, as a number."""
    return error.number if isinstance(error, Stopped) else int(signal.SIGINT)
