# SPDX-License-Identifier: MIT
"""Pairs that go through the backbone at once, as on a GPU, teach what they teach one by one."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import torch
from training_runs import WARM_UP, MakeRecipe, log, options, state

from hybridreg.learned.training.initial_weights import first_network
from hybridreg.learned.training.resuming import check_same
from hybridreg.learned.training.steps import forward_pass
from hybridreg.learned.training.training_run import train

ALL = {"infonce": 1.0, "coarse": 1.0, "fine": 1.0, "mask": 1.0}


def trained(make_recipe: MakeRecipe, cache: Path, out: Path, **phase: Any) -> Path:
    # Adam would turn the rounding of gradients near zero into whole steps.
    content = {"name": "packed", "steps": 2, "rate": 0.1, "optimizer": "sgd", "accumulate": 4, **phase}
    train(make_recipe(phase=[content], log_every=1), options(out, cache))
    return out


@pytest.mark.parametrize("losses", [WARM_UP, ALL], ids=["warm-up", "all"])
def test_a_pack_teaches_what_its_pairs_teach_one_by_one(
    make_recipe: MakeRecipe,
    cache: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    losses: dict[str, float],
) -> None:
    seen: list[int] = []
    true_packed = forward_pass.packed

    def watched(pyramids: Any) -> Any:
        seen.append(len(pyramids))
        return true_packed(pyramids)

    monkeypatch.setattr(forward_pass, "packed", watched)
    apart = trained(make_recipe, cache, tmp_path / "apart", losses=losses)
    assert seen == []
    at_once = trained(make_recipe, cache, tmp_path / "packed", losses=losses, packed=3)
    assert seen == [3, 3]  # and one pair by itself in each step
    start = first_network(make_recipe()).state_dict()
    one, other = ({name: w - start[name] for name, w in state(out).items()} for out in (apart, at_once))
    moved = math.sqrt(sum(float(w.square().sum()) for w in one.values()))
    off = math.sqrt(sum(float((w - other[name]).square().sum()) for name, w in one.items()))
    assert moved > 0.0
    assert off < 1e-3 * moved
    for got, want in zip(log(at_once), log(apart), strict=True):
        assert float(got["loss"]) == pytest.approx(float(want["loss"]), abs=1e-4)


def test_a_bad_pair_of_a_pack_is_named_alone(
    make_recipe: MakeRecipe, cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    true_objective = forward_pass.objective

    def spoiled(network: torch.nn.Module, sample: Any, *rest: Any) -> Any:
        outcome = true_objective(network, sample, *rest)
        nan = outcome.total * float("nan")
        return replace(outcome, total=nan) if sample.number == 1 else outcome

    monkeypatch.setattr(forward_pass, "objective", spoiled)
    out = trained(make_recipe, cache, tmp_path / "out", losses=WARM_UP, packed=4)
    assert [line["skipped"] for line in log(out)] == ["1", "1"]


def test_pairs_that_are_normalised_together_are_not_packed(make_recipe: MakeRecipe) -> None:
    network = make_recipe().to_dict()["network"]
    network["backbone"]["norm_scope"] = "stacked"
    phase = {"name": "packed", "steps": 1, "packed": 2, "losses": WARM_UP}
    with pytest.raises(ValueError, match="packed=2 would normalise several pairs as one; choose packed=1"):
        make_recipe(phase=[phase], network=network)


def test_a_run_goes_on_with_other_packs(make_recipe: MakeRecipe) -> None:
    phase = {
        "name": "packed",
        "steps": 4,
        "rate": 0.1,
        "optimizer": "sgd",
        "accumulate": 4,
        "losses": WARM_UP,
    }
    for packed in (4, 1):
        recipe = make_recipe(phase=[{**phase, "packed": packed}], log_every=1)
        check_same(recipe.to_dict(), make_recipe(phase=[phase], log_every=1).to_dict(), 0)
    with pytest.raises(ValueError, match="another phase"):
        check_same(recipe.to_dict(), make_recipe(phase=[{**phase, "rate": 0.2}]).to_dict(), 0)
