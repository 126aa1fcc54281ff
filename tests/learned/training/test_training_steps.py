# SPDX-License-Identifier: MIT
"""A step that is not finite is skipped, counted and named; training goes on without it."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import torch
from torch import Tensor
from training_runs import WARM_UP, MakeRecipe, log, options, same, state

from hybridreg.learned.training import loop
from hybridreg.learned.training.initial_weights import first_network
from hybridreg.learned.training.processes import start_processes
from hybridreg.learned.training.steps import forward_pass
from hybridreg.learned.training.steps.objective import Outcome
from hybridreg.learned.training.steps.schedule import make_optimizer
from hybridreg.learned.training.training_run import train

PHASE = {"name": "warm-up", "steps": 4, "rate": 1e-3, "losses": WARM_UP}


def spoiled(at: int, spoil: Callable[[Tensor], Tensor]) -> Callable[..., Outcome]:
    """The objective with another total for the sample of that number."""
    true_objective = forward_pass.objective

    def called(network: torch.nn.Module, sample: Any, *rest: Any) -> Outcome:
        outcome = true_objective(network, sample, *rest)
        if sample.number != at:
            return outcome
        return dataclasses.replace(outcome, total=spoil(outcome.total))

    return called


def not_a_number(total: Tensor) -> Tensor:
    return total * float("nan")


def endless_slope(total: Tensor) -> Tensor:
    # The value is finite; the root's derivative at zero is not.
    return total + (total - total.detach()).sqrt()


@pytest.mark.parametrize(("spoil", "what"), [(not_a_number, "loss"), (endless_slope, "gradient")])
def test_a_bad_step_is_skipped_counted_and_named(
    make_recipe: MakeRecipe,
    cache: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    spoil: Callable[[Tensor], Tensor],
    what: str,
) -> None:
    recipe = make_recipe(phase=[PHASE], log_every=1, data={"train": make_recipe().to_dict()["data"]["train"]})
    monkeypatch.setattr(forward_pass, "objective", spoiled(2, spoil))
    before: list[dict[str, Tensor]] = []
    true_step = loop.finish_step

    def watched(fabric: Any, optimizer: Any, parameters: Any, *rest: Any) -> Any:
        held = {str(i): p.detach().clone() for i, p in enumerate(parameters)}
        outcome = true_step(fabric, optimizer, parameters, *rest)
        now = {str(i): p.detach().clone() for i, p in enumerate(parameters)}
        before.append({"moved": torch.tensor(not same(held, now))})
        return outcome

    monkeypatch.setattr(loop, "finish_step", watched)
    with caplog.at_level("WARNING", logger="hybridreg.learned.training"):
        train(recipe, options(tmp_path, cache))
    assert [bool(step["moved"]) for step in before] == [True, True, False, True]
    card = json.loads((tmp_path / "best" / "card.json").read_text())
    ((name, times),) = card["skipped"].items()
    assert name.startswith("yard-")
    assert times == 1
    assert f"step 3 skipped, {what} not finite: {name}" in caplog.text
    lines = log(tmp_path)
    assert [line["skipped"] for line in lines] == ["0", "0", "1", "1"]
    assert math.isfinite(float(lines[3]["loss"]))
    assert all(bool(torch.isfinite(tensor).all()) for tensor in state(tmp_path).values())


def test_one_bad_pair_spoils_its_whole_batch_and_is_named_alone(
    make_recipe: MakeRecipe, cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe = make_recipe(phase=[{**PHASE, "accumulate": 2, "steps": 2}])
    monkeypatch.setattr(forward_pass, "objective", spoiled(1, not_a_number))
    train(recipe, options(tmp_path, cache))
    skipped = json.loads((tmp_path / "best" / "card.json").read_text())["skipped"]
    assert list(skipped.values()) == [1]


def test_a_pair_that_breaks_while_it_is_read_is_a_skipped_step(
    make_recipe: MakeRecipe, cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from hybridreg.learned.training.data.pair_source import PairSource

    true_load = PairSource.load

    def broken(self: PairSource, number: int, scale: float = 1.0) -> Any:
        if self.title == "yards" and self.ids[number] == "yard-1":
            raise OSError("the disk is gone")
        return true_load(self, number, scale)

    monkeypatch.setattr(PairSource, "load", broken)
    train(make_recipe(phase=[PHASE]), options(tmp_path, cache))
    assert json.loads((tmp_path / "best" / "card.json").read_text())["skipped"] == {"yard-1": 2}


def test_gradients_are_clipped_to_the_given_length() -> None:
    fabric = start_processes(1, "cpu", "32-true")
    weight = torch.nn.Parameter(torch.zeros(4))
    weight.grad = torch.tensor([3.0, 0.0, 4.0, 0.0])
    optimizer = torch.optim.SGD([weight], lr=1.0)
    outcome = loop.finish_step(fabric, optimizer, [weight], torch.zeros(1), 1.0, False)
    assert outcome.norm == pytest.approx(5.0)
    assert torch.allclose(weight.detach(), torch.tensor([-0.6, 0.0, -0.8, 0.0]), atol=1e-5)
    assert weight.grad is None
    assert (outcome.stepped, outcome.stop, outcome.due) == (True, False, False)


@pytest.mark.parametrize("name", ["sgd", "adam", "adamw"])
def test_a_parameter_may_get_its_first_gradient_after_others(make_recipe: MakeRecipe, name: str) -> None:
    recipe = make_recipe(phase=[{**PHASE, "optimizer": name}])
    network = first_network(recipe)
    optimizer = make_optimizer(recipe.phase[0], network)
    early, late = list(network.backbone.parameters()), list(network.in_proj.parameters())
    for parameters in (early, early + late):
        for parameter in parameters:
            parameter.grad = torch.ones_like(parameter)
        before = network.in_proj.weight.detach().clone()
        optimizer.step()
    assert not torch.equal(network.in_proj.weight, before)
