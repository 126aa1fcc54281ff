# SPDX-License-Identifier: MIT
"""Output of a running training: learning curves, validations, the best weights."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path

import torch
from torch import Tensor

from hybridreg.learned.cross3dreg.network import RegistrationNetwork
from hybridreg.learned.matching.procrustes import apply_transform
from hybridreg.learned.pretrained import Pretrained
from hybridreg.learned.training.checkpoint import Progress
from hybridreg.learned.training.curve_files import CurveFile, Value
from hybridreg.learned.training.data.opened_source import OpenedSource
from hybridreg.learned.training.data.samples import Sample
from hybridreg.learned.training.data.training_examples import Example
from hybridreg.learned.training.recipe import Phase
from hybridreg.learned.training.reporting import Reporter
from hybridreg.learned.training.steps.objective import Outcome
from hybridreg.learned.training.validation import PROTOCOL, Validation, pair_inlier_ratio, rank, validate
from hybridreg.learned.weights import save_pretrained

_VALIDATION = tuple(Validation.__dataclass_fields__)


class Record:
    """Sums between two lines of the log, and the files of the run.

    Only the first process ``writes``; ``total`` sums a tensor over all processes; ``losses`` names the parts of the
    network's loss.
    """

    def __init__(
        self,
        out: Path,
        progress: Progress,
        val: Sequence[OpenedSource],
        reporter: Reporter,
        *,
        writes: bool,
        log_every: int,
        losses: Sequence[str],
        total: Callable[[Tensor], Tensor] | None = None,
    ) -> None:
        self.out, self.progress, self.val = out, progress, val
        self.reporter, self.writes, self.log_every = reporter, writes, log_every
        self._total = total
        self._means = ("loss", *losses, "hits", "pir", "ir", "norm")
        columns = ("phase", "step", "rate", *self._means, "skipped", "steps_per_s", "data_share")
        self.curve = CurveFile(out / "log.csv", columns)
        self.validations = CurveFile(out / "validation.csv", ("phase", *_VALIDATION))
        if writes:
            self.curve.begin(progress.total)
            self.validations.begin(progress.total)
        else:  # the checkpoint's sums are those of all processes, and the first one has them
            progress.window.clear()
        self._clock = self._line_clock = time.monotonic()
        self._data_seconds, self._line_steps = 0.0, 0

    def begin_phase(self, phase: Phase, steps: int) -> None:
        """A phase begins or continues."""
        self.reporter.begin(phase.name, steps, self.progress.step)
        self._line_clock, self._line_steps, self._data_seconds = time.monotonic(), 0, 0.0

    @contextmanager
    def data_time(self) -> Iterator[None]:
        """Count the block's seconds as waiting for data."""
        start = time.monotonic()
        yield
        self._data_seconds += time.monotonic() - start

    def outcome(self, network: Pretrained, outcome: Outcome, sample: Sample | Example) -> None:
        """Add a sample's losses; where a line of the log is due, its matches are evaluated too."""
        self._add("loss", float(outcome.total.detach()))
        for name, loss in outcome.parts.items():
            self._add(name, float(loss.detach()))
        if outcome.hits is not None:
            self._add("hits", float(outcome.hits))
        if outcome.matched is not None and (self.progress.step + 1) % self.log_every == 0:
            assert isinstance(network, RegistrationNetwork)
            assert isinstance(sample, Sample)
            for name, value in _ratios(network, outcome, sample).items():
                self._add(name, value)

    def step(self, phase: Phase, step: int, rate: float, norm: float) -> None:
        """A step is done; write a line when one is due."""
        self._add("norm", norm)
        self._line_steps += 1
        self.reporter.advance()
        if (step + 1) % self.log_every:
            return
        self.collect()
        seconds = max(time.monotonic() - self._line_clock, 1e-9)
        row: dict[str, Value] = {
            "total": self.progress.total,
            "phase": phase.name,
            "step": step + 1,
            "rate": rate,
            **{name: total / count for name, (total, count) in self.progress.window.items()},
            "skipped": sum(self.progress.skipped.values()),
            "steps_per_s": self._line_steps / seconds,
            "data_share": self._data_seconds / seconds,
        }
        if self.writes:
            self.curve.append(row)
            self.reporter.line(row)
        self.progress.window.clear()
        self._line_clock, self._line_steps, self._data_seconds = time.monotonic(), 0, 0.0

    def collect(self) -> None:
        """Bring the sums of all processes to the first one; all must call it at the same step."""
        if self._total is None:
            return
        window = self.progress.window
        sums = self._total(
            torch.tensor([window.get(name, [0.0, 0.0]) for name in self._means], dtype=torch.float64)
        )
        window.clear()
        if self.writes:
            found = zip(self._means, sums.tolist(), strict=True)
            window.update({name: [total, count] for name, (total, count) in found if count})

    def validate(self, network: Pretrained, phase: Phase, device: torch.device) -> None:
        """Measure the network, keep it as ``last/``, and as ``best/`` where it is."""
        start = time.monotonic()
        matcher = phase.losses.matcher
        found = [validate(network, source, matcher=matcher, device=device) for source in self.val]
        for each in found:
            self.validations.append({"total": self.progress.total, "phase": phase.name, **asdict(each)})
        self.reporter.validation(found, self.progress.total)
        save_pretrained(network, self.out / "last")
        now = rank(found, matcher) if found else (float(matcher), float(self.progress.total))
        if not self.progress.best or now > tuple(self.progress.best):
            self.progress.best, self.progress.best_total = now, self.progress.total
            save_pretrained(network, self.out / "best")
        # Validation is not training: the next line's speed must not include it.
        self._line_clock += time.monotonic() - start

    def keep_time(self) -> None:
        """Bring the run's clock up to date."""
        now = time.monotonic()
        self.progress.seconds += now - self._clock
        self._clock = now

    def _add(self, name: str, value: float) -> None:
        if value == value:
            total, count = self.progress.window.get(name, [0.0, 0.0])
            self.progress.window[name] = [total + value, count + 1.0]


@torch.no_grad()
def _ratios(network: RegistrationNetwork, outcome: Outcome, sample: Sample) -> dict[str, float]:
    matched = outcome.matched
    assert matched is not None
    superpoints, matches = network.match(matched.encoding, matched.kept, matched.features)
    T = sample.targets.transform.to(matches.source.device)
    right = (apply_transform(matches.source, T) - matches.target).norm(dim=1) < PROTOCOL.inlier_m
    return {
        "pir": pair_inlier_ratio(superpoints, sample.to(T.device).targets),
        "ir": float(right.float().mean()) if len(right) else 0.0,
    }
