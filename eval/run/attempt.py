# SPDX-License-Identifier: MIT
"""One method on one pair, without access to the true pose."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from hybridreg.eval.run.row import ROUNDED
from hybridreg.frames import raise_pose
from hybridreg.geometry import se3
from hybridreg.matches import Correspondences
from hybridreg.pair import Pair
from hybridreg.pipeline import Trace
from hybridreg.result import RegistrationResult
from hybridreg.runtime.resources import peak_memory_mb, reset_peak_memory


@runtime_checkable
class Traceable(Protocol):
    """A method that exposes what its stages produced: `hybridreg.Pipeline`, or anything with the same interface."""

    def trace(self, pair: Pair, *, seed: int = 0) -> Trace: ...

    def conclude(self, trace: Trace, *, seed: int = 0) -> RegistrationResult: ...


# Or a function of pair and seed that returns a 4x4 pose, a RegistrationResult, anything else with the pose as
# `transformation` (Open3D's results), or None for "not found".
Method = Traceable | Callable[[Pair, int], Any]


@dataclass(frozen=True, eq=False, kw_only=True)
class Attempt:
    """What a method returned for a pair."""

    T: Any
    seconds: dict[str, float]
    peak_memory_mb: float | None = None
    error: str | None = None
    T_estimated: Any = None
    matches: Correspondences | None = None
    result: RegistrationResult | None = None
    trace: Trace | None = None


def attempt(method: Method, pair: Pair, seed: int) -> Attempt:
    """Run a method; whatever it raises becomes `error`, in one line.

    Raises
    ------
    ImportError
        A package that the method needs is not here: it was not run.
    """
    reset_peak_memory()
    start = time.perf_counter()
    try:
        tried = _traced(method, pair, seed) if isinstance(method, Traceable) else _called(method, pair, seed)
    except ImportError:  # what was never run has not failed
        raise
    except Exception as error:  # a failing pair is a failed row, never an abort
        seconds = {"total": time.perf_counter() - start}
        return Attempt(T=None, seconds=seconds, peak_memory_mb=peak_memory_mb(), error=one_line(error))
    tried.seconds["total"] = time.perf_counter() - start
    return dataclasses.replace(tried, peak_memory_mb=peak_memory_mb())


def _traced(method: Traceable, pair: Pair, seed: int) -> Attempt:
    trace = method.trace(pair, seed=seed)
    result = method.conclude(trace, seed=seed)
    return Attempt(
        T=_pose(result.transformation) if trace.refined.found else None,
        T_estimated=raise_pose(trace.estimated.T, pair) if trace.estimated.found else None,
        seconds=dict(result.seconds),
        matches=result.matches,
        result=result,
        trace=trace,
    )


def _called(method: Callable[[Pair, int], Any], pair: Pair, seed: int) -> Attempt:
    answer = method(pair, seed)
    if answer is None:
        return Attempt(T=None, seconds={})
    if not isinstance(answer, RegistrationResult):
        return Attempt(T=_pose(getattr(answer, "transformation", answer)), seconds={})
    return Attempt(
        # A pose that was not found is the identity, which would count as right for nearby pairs.
        T=_pose(answer.transformation) if answer.found else None,
        seconds=dict(answer.seconds),
        matches=answer.matches,
        result=answer,
    )


def _pose(answer: Any) -> Any:
    try:
        return se3.rounded(answer, "the method's answer", ROUNDED)
    except ValueError as error:
        raise ValueError(
            f"{error}; a method returns a rigid 4x4 pose, a RegistrationResult, or None where it found none"
        ) from error


def one_line(error: BaseException) -> str:
    """An exception as one line of text."""
    return " ".join(f"{type(error).__name__}: {error}".split())
