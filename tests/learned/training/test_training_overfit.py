# SPDX-License-Identifier: MIT
"""The loop learns: on one pair its features must find their partners."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from training_runs import WARM_UP, MakeRecipe, log, options

from hybridreg.learned.training.training_run import train


def test_sixteen_steps_overfit_a_pair(make_recipe: MakeRecipe, cache: Path, tmp_path: Path) -> None:
    source = {**make_recipe().to_dict()["data"]["train"][0], "pairs": 1}
    recipe = make_recipe(
        data={"train": [source]},
        log_every=1,
        augmentation={"rotation": "none", "shift": 0.0},
        phase=[{"name": "warm-up", "steps": 16, "rate": 3e-3, "warmup": 2, "losses": WARM_UP}],
    )
    train(recipe, options(tmp_path, cache))
    hits = np.array([float(line["hits"]) for line in log(tmp_path)])
    losses = np.array([float(line["infonce"]) for line in log(tmp_path)])
    # Hundreds of candidates and a handful in each partner's surroundings: chance finds a few in a hundred, and a
    # network that stands still finds what it found at first.
    assert hits[0] < 0.4
    assert hits[-3:].mean() > 0.8
    assert losses[-3:].mean() < 0.4 * losses[0]
