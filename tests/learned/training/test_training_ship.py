# SPDX-License-Identifier: MIT
"""Weights go into the package in half precision, with their card, and only from a finished run."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import torch
from training_runs import Run

from hybridreg.learned.training import ship
from hybridreg.learned.weights import from_pretrained


def test_shipped_weights_are_the_runs_own_in_half_the_size(whole: Run, tmp_path: Path) -> None:
    folder = ship.ship(whole.out / "best", tmp_path)
    assert folder == tmp_path / "tiny"
    assert sorted(file.name for file in folder.iterdir()) == [
        "card.json",
        "card.md",
        "config.json",
        "model.safetensors",
    ]
    sizes = [(place / "model.safetensors").stat().st_size for place in (folder, whole.out / "best")]
    assert sizes[0] < 0.55 * sizes[1]
    before, after = from_pretrained(whole.out / "best").state_dict(), from_pretrained(folder).state_dict()
    for name, tensor in before.items():
        assert after[name].dtype == tensor.dtype
        assert torch.allclose(after[name], tensor, rtol=1e-3, atol=1e-6), name
    assert json.loads((folder / "card.json").read_text())["recipe"]["name"] == "tiny"


def test_an_unfinished_run_and_too_much_are_refused(
    whole: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(FileNotFoundError, match=r"card\.json"):
        ship.ship(whole.out / "last", tmp_path)
    assert list(tmp_path.iterdir()) == []
    monkeypatch.setattr(ship, "MOST", 1000)
    with pytest.raises(ValueError, match="more than 0 MB: leave some out"):
        ship.ship(whole.out / "best", tmp_path)
