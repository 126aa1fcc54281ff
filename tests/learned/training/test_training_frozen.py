# SPDX-License-Identifier: MIT
"""A frozen backbone is computed once a pair where nothing changes its features, and the result is the same."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import torch
from training_runs import MakeRecipe, log, options, state

from hybridreg.learned.training.data.augmentation import Augmentation
from hybridreg.learned.training.data.frozen import lasting
from hybridreg.learned.training.recipe import Phase, Recipe
from hybridreg.learned.training.steps import forward_pass
from hybridreg.learned.training.training_run import train

UPRIGHT = {"tilt": 0.0, "jitter": 0.0}
FROZEN = {"name": "heads", "steps": 6, "rate": 1e-3, "backbone_rate": 0.0}


def heads(make_recipe: MakeRecipe, **augmentation: Any) -> Recipe:
    network = {"backbone": {"kernel": "cylindrical"}}
    return make_recipe(phase=[FROZEN], network=network, augmentation={**UPRIGHT, **augmentation})


def test_kept_features_train_the_same_heads(
    make_recipe: MakeRecipe, cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe, runs = heads(make_recipe), []
    for active in (True, False):
        calls: list[int] = []
        with monkeypatch.context() as patch:
            patch.setattr(forward_pass, "lasting", lambda *_, active=active: active)
            out = tmp_path / str(active)
            original = forward_pass.FrozenFeatures.of

            def counted(self: Any, *rest: Any, calls: list[int] = calls, original: Any = original) -> Any:
                found = original(self, *rest)
                calls.append(len(self._known))
                return found

            patch.setattr(forward_pass.FrozenFeatures, "of", counted)
            train(recipe, options(out, cache))
        runs.append(([float(row["loss"]) for row in log(out)], calls))
    (kept, known), (fresh, nothing) = runs
    assert known[-1] == 2  # both pairs, each computed once
    assert set(nothing) == {0}
    # Half precision before the first step; each step of the optimiser then makes more of it, on some processors 0.7 %.
    assert kept[0] == pytest.approx(fresh[0], rel=2e-3)
    assert kept == pytest.approx(fresh, rel=2e-2)


def test_the_backbone_stays(make_recipe: MakeRecipe, cache: Path, tmp_path: Path) -> None:
    from hybridreg.learned.training.initial_weights import first_network

    recipe = heads(make_recipe)
    before = first_network(recipe).state_dict()
    train(recipe, options(tmp_path / "run", cache))
    after = state(tmp_path / "run")
    changed = {name.partition(".")[0] for name in after if not torch.equal(after[name], before[name])}
    assert "backbone" not in changed
    assert "transformer" in changed


@pytest.mark.parametrize(
    ("rate", "kernel", "augmentation", "expected"),
    [
        (0.0, "cylindrical", Augmentation(tilt=0.0, jitter=0.0), True),
        (0.0, "cylindrical", Augmentation(rotation="none", jitter=0.0), True),
        (0.1, "cylindrical", Augmentation(tilt=0.0, jitter=0.0), False),
        (0.0, "spatial", Augmentation(tilt=0.0, jitter=0.0), False),
        (0.0, "cylindrical", Augmentation(tilt=5.0, jitter=0.0), False),
        (0.0, "cylindrical", Augmentation(tilt=0.0, jitter=0.01), False),
        (0.0, "cylindrical", Augmentation(tilt=0.0, jitter=0.0, rotation="full"), False),
        (0.0, "cylindrical", Augmentation(tilt=0.0, jitter=0.0, scale=(0.9, 1.1)), False),
    ],
)
def test_features_last_only_where_nothing_changes_them(
    make_recipe: MakeRecipe, rate: float, kernel: Any, augmentation: Augmentation, expected: bool
) -> None:
    backbone = make_recipe(network={"backbone": {"kernel": kernel}}).network.backbone
    phase = Phase(name="p", steps=1, backbone_rate=rate)
    assert lasting(phase, augmentation, backbone) is expected
