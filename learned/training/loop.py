# SPDX-License-Identifier: MIT
"""The loop: phase by phase, step by step, with log, validation and checkpoints in between."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import torch
from torch import nn

from hybridreg.learned.pretrained import Pretrained
from hybridreg.learned.training import checkpoint
from hybridreg.learned.training.checkpoint import Progress
from hybridreg.learned.training.data.opened_source import OpenedSource
from hybridreg.learned.training.data.order import Order
from hybridreg.learned.training.data.samples import PhaseSamples, Sample, Unusable, stream
from hybridreg.learned.training.data.training_examples import Example
from hybridreg.learned.training.recipe import Phase, Recipe
from hybridreg.learned.training.record import Record
from hybridreg.learned.training.steps.forward_pass import ForwardPass
from hybridreg.learned.training.steps.gradients import StepOutcome, finish_step
from hybridreg.learned.training.steps.schedule import make_optimizer, rate_at, set_rate, steps_of, trainable
from hybridreg.learned.training.stop_flag import StopFlag

if TYPE_CHECKING:
    from lightning_fabric import Fabric

_log = logging.getLogger(__name__)
CHECKPOINT = "checkpoint.pt"
Upcoming = Iterator[Sample | Example | Unusable]


class Loop:
    """A run of a recipe; ``run`` continues from ``progress``."""

    def __init__(
        self,
        fabric: Fabric,
        recipe: Recipe,
        network: Pretrained,
        sources: Sequence[OpenedSource],
        out: Path,
        record: Record,
        stop: StopFlag,
    ) -> None:
        self.fabric, self.recipe, self.network = fabric, recipe, network
        self.sources, self.out, self.record, self.stop = sources, out, record, stop
        self.progress = record.progress
        self._saved = time.monotonic()

    def run(self, optimizer_state: dict[str, Any] | None = None) -> bool:
        """Train to the end; false when the run was stopped before that, with a checkpoint written."""
        while self.progress.phase < len(self.recipe.phase):
            phase = self.recipe.phase[self.progress.phase]
            optimizer = make_optimizer(phase, self.network)
            if optimizer_state is not None:
                optimizer.load_state_dict(optimizer_state)
                # How it steps is this build's matter, not the checkpoint's.
                for group in optimizer.param_groups:
                    group.update({key: optimizer.defaults[key] for key in ("fused", "foreach")})
                optimizer_state = None
            if not self._run_phase(phase, optimizer):
                return False
            self.progress.phase, self.progress.step = self.progress.phase + 1, 0
            self._save(None)
        return True

    def _run_phase(self, phase: Phase, optimizer: torch.optim.Optimizer) -> bool:
        batch = self._batch(phase)
        samples, steps = self._samples(phase, batch)
        parameters = trainable(optimizer)
        self.record.begin_phase(phase, steps)
        losses = ForwardPass(self.network, self.recipe, phase, self._seed())
        upcoming = stream(samples, self._numbers(batch, steps), self.recipe.data.loaders)
        for step in range(self.progress.step, steps):
            set_rate(optimizer, rate_at(phase, step, steps))
            bad = self._gather(losses, samples, upcoming, step * batch, batch)
            votes = (self.stop.asked, self._due())
            outcome = finish_step(self.fabric, optimizer, parameters, bad, self.recipe.clip, *votes)
            self._note(outcome, samples, range(step * batch, (step + 1) * batch))
            self.record.step(phase, step, rate_at(phase, step, steps), outcome.norm)
            last = step + 1 == steps
            if last or (self.recipe.every and (step + 1) % self.recipe.every == 0):
                self._validate(phase)
            if outcome.stop or outcome.due:
                self._save(optimizer)
            if outcome.stop and not last:
                return False
        return True

    def _gather(
        self, losses: ForwardPass, samples: PhaseSamples, upcoming: Upcoming, first: int, batch: int
    ) -> torch.Tensor:
        # Gradients of this process's share of the batch; 1 in the result where a loss was not finite.
        bad = torch.zeros(batch, device=self.fabric.device)
        mine = range(self.fabric.global_rank, batch, self.fabric.world_size)
        for places in losses.groups(mine):
            with self.record.data_time():
                found = [next(upcoming) for _ in places]
            assert [each.number for each in found] == [first + place for place in places]
            for place, each in zip(places, found, strict=True):
                if isinstance(each, Unusable):
                    _log.warning("pair %s cannot be used: %s", each.id, each.problem)
                    bad[place] = 1.0
            usable = [each for each in found if not isinstance(each, Unusable)]
            if len(usable) < len(found):
                continue  # a step with a bad pair is skipped as a whole
            here = [each.to(self.fabric.device) for each in usable]
            with self.fabric.autocast():
                outcomes = list(losses(here, [samples.order[each.number] for each in here]))
            totals = torch.stack([outcome.total for outcome in outcomes])
            finite = torch.isfinite(totals.detach())
            # One outcome a place, or one of all of them.
            bad[places] = (~finite).float().expand(len(places))
            if bool(finite.all()):
                (totals.mean() * len(places) / batch).backward()
                for outcome, one in zip(outcomes, here, strict=False):
                    self.record.outcome(self.network, outcome, one)
        return bad

    def _samples(self, phase: Phase, batch: int) -> tuple[PhaseSamples, int]:
        weights = [
            phase.data.get(source.title, 0.0) if phase.data else own.weight
            for source, own in zip(self.sources, self.recipe.data.train, strict=True)
        ]
        sizes = [len(source) for source in self.sources]
        used = sum(size for size, weight in zip(sizes, weights, strict=True) if weight)
        steps = steps_of(phase, used, batch)
        order = Order(sizes, weights, steps * batch, self._seed())
        return PhaseSamples(self.sources, order, self.recipe.augmentation, self._seed()), steps

    def _batch(self, phase: Phase) -> int:
        world = self.fabric.world_size
        batch = max(phase.accumulate, world)
        if batch % world:
            raise ValueError(
                f"phase {phase.name!r}: accumulate={batch} is not a multiple of {world} processes"
            )
        return batch

    def _numbers(self, batch: int, steps: int) -> list[int]:
        mine = range(self.fabric.global_rank, batch, self.fabric.world_size)
        return [step * batch + place for step in range(self.progress.step, steps) for place in mine]

    def _seed(self) -> tuple[int, int]:
        return self.recipe.seed, self.progress.phase

    def _note(self, outcome: StepOutcome, samples: PhaseSamples, numbers: range) -> None:
        self.progress.step += 1
        self.progress.total += 1
        self.progress.visits += len(numbers)
        if outcome.stepped:
            return
        # A gradient that is not finite may come from any pair of the step.
        what = "loss" if outcome.bad else "gradient"
        names = [samples.id_of(numbers[place]) for place in outcome.bad or range(len(numbers))]
        for name in names:
            self.progress.skipped[name] = self.progress.skipped.get(name, 0) + 1
        _log.warning("step %d skipped, %s not finite: %s", self.progress.step, what, ", ".join(names))

    def _validate(self, phase: Phase) -> None:
        if self.fabric.is_global_zero:
            self.record.validate(self.network, phase, self.fabric.device)
        self.fabric.barrier()

    def _due(self) -> bool:
        return (time.monotonic() - self._saved) / 60.0 >= self.recipe.checkpoint_minutes

    def _save(self, optimizer: torch.optim.Optimizer | None) -> None:
        self.record.collect()
        if self.fabric.is_global_zero:
            self.record.keep_time()
            checkpoint.save(
                self.out / CHECKPOINT,
                self.progress,
                self.network,
                optimizer,
                self.recipe.to_dict(),
                {source.title: source.content for source in self.sources},
            )
        self._saved = time.monotonic()
        self.fabric.barrier()


def count_parameters(network: nn.Module) -> int:
    """Number of parameters of a network, including frozen ones."""
    return sum(parameter.numel() for parameter in network.parameters())


__all__ = ["CHECKPOINT", "Loop", "Progress", "count_parameters"]
