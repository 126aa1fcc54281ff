# SPDX-License-Identifier: MIT
"""TensorBoard gets what the log gets, where it is installed; without it nothing is missed."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from hybridreg.learned.training.reporting import Reporter
from hybridreg.learned.training.validation import Validation


class Writer:
    """Stands for TensorBoard's."""

    made: list[Writer]

    def __init__(self, folder: Path) -> None:
        self.folder, self.scalars, self.closed = folder, [], False  # type: ignore[var-annotated]
        Writer.made.append(self)

    def add_scalar(self, name: str, value: float, step: int) -> None:
        self.scalars.append((name, value, step))

    def close(self) -> None:
        self.closed = True


FOUND = Validation(title="near", pairs=2, recall=0.5, rre_deg=1.0, rte_m=2.0, inlier_ratio=0.25,
                   pir=float("nan"), mask_f1=0.75)  # fmt: skip


def test_the_board_gets_losses_and_validations(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Writer.made = []
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", SimpleNamespace(SummaryWriter=Writer))
    with Reporter(tmp_path) as reporter:
        reporter.begin("warm-up", 4)
        reporter.line({"total": 7, "phase": "warm-up", "step": 3, "loss": 2.5, "pir": float("nan")})
        reporter.validation([FOUND], 8)
    (board,) = Writer.made
    assert board.folder == tmp_path / "tensorboard"
    assert board.closed
    assert ("train/loss", 2.5, 7) in board.scalars
    assert ("val/near/recall", 0.5, 8) in board.scalars
    assert not [name for name, *_ in board.scalars if name.endswith("pir")], "NaN is no point of a curve"


def test_without_it_and_in_other_processes_there_is_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", None)
    with Reporter(tmp_path) as reporter:
        assert reporter.board is None
        reporter.line({"total": 7, "phase": "warm-up", "step": 3, "loss": 2.5})
        reporter.validation([FOUND], 8)
    told = capsys.readouterr().err
    assert "warm-up 3: loss 2.5" in told
    assert (
        "validation at 8, near: recall 0.500, inlier ratio 0.250, 1.00 deg, 2.00 m, mask F1 0.750\n" in told
    ), "what a network does not have is left out"
    Writer.made = []
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", SimpleNamespace(SummaryWriter=Writer))
    with Reporter(tmp_path, quiet=True) as reporter:
        reporter.validation([FOUND], 8)
    assert Writer.made == []
    assert capsys.readouterr().err == ""
