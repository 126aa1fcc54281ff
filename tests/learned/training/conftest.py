# SPDX-License-Identifier: MIT
"""Two tiny pairs on disk, a recipe of seconds, and one whole run of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from training_runs import WARM_UP, MakeRecipe, Run, options, write_pair

from hybridreg.learned.training import recipe_file
from hybridreg.learned.training.recipe import Recipe
from hybridreg.learned.training.training_run import train


@pytest.fixture(scope="session")
def pairs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of two pairs."""
    root = tmp_path_factory.mktemp("training") / "pairs"
    for seed in (0, 1):
        write_pair(root / f"yard-{seed}", seed)
    return root


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Prepared pairs that all runs of the session share."""
    return tmp_path_factory.mktemp("prepared")


@pytest.fixture(scope="session")
def content(pairs: Path) -> dict[str, Any]:
    """A recipe of two phases as a file would have it."""
    return {
        "size": "nano",
        "seed": 3,
        "log_every": 2,
        "every": 3,
        "checkpoint_minutes": 0.0,
        "infonce": {"anchors": 64},
        "data": {
            "train": [{"data": str(pairs), "name": "yards"}],
            "val": [{"data": str(pairs), "name": "one", "pairs": 1}],
        },
        "phase": [
            {"name": "warm-up", "steps": 4, "rate": 2e-3, "warmup": 2, "decay": "linear", "losses": WARM_UP},
            {"name": "matching", "steps": 4, "rate": 1e-3, "use_predicted": 0.5},
        ],
    }


@pytest.fixture(scope="session")
def make_recipe(content: dict[str, Any]) -> MakeRecipe:
    """The recipe with some of its top keys changed."""

    def make(**changes: Any) -> Recipe:
        return recipe_file.parse({**content, **changes}, name="tiny")

    return make


@pytest.fixture(scope="session")
def whole(make_recipe: MakeRecipe, cache: Path, tmp_path_factory: pytest.TempPathFactory) -> Run:
    """The recipe, run without a break."""
    recipe, out = make_recipe(), tmp_path_factory.mktemp("whole")
    assert train(recipe, options(out, cache)) == out / "best"
    return Run(recipe, out)
