# SPDX-License-Identifier: MIT
"""Progress of a run: a progress bar on a terminal, otherwise a line now and then; TensorBoard where installed."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.logging import RichHandler
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from hybridreg.learned.training.validation import Validation

Row = Mapping[str, Any]
# Columns of a line that are only for the file, and those that come last.
_HIDDEN = ("total", "phase", "step", "skipped", "data_share", "norm")
_LAST = ("rate", "steps_per_s")


class Reporter:
    """Progress on stderr. ``quiet`` is for all processes but the first."""

    def __init__(self, folder: Path, *, quiet: bool = False) -> None:
        self.console = Console(stderr=True, quiet=quiet)
        self.terminal = self.console.is_terminal and not quiet
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            TextColumn("{task.fields[figures]}"),
        )
        self.bar = Progress(*columns, console=self.console, disable=not self.terminal)
        self.board = None if quiet else _board(folder)
        self._task = self.bar.add_task("", total=None, figures="", visible=False)

    def __enter__(self) -> Reporter:
        handler = RichHandler(console=self.console, show_path=False)
        logging.getLogger("hybridreg.learned.training").addHandler(handler)
        logging.getLogger("hybridreg.learned.training").setLevel(logging.INFO)
        self._handler = handler
        self.bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.bar.stop()
        logging.getLogger("hybridreg.learned.training").removeHandler(self._handler)
        if self.board is not None:
            self.board.close()

    def begin(self, title: str, total: int, done: int = 0) -> None:
        """Begin a new task."""
        self.bar.reset(self._task, description=title, total=total, completed=done, figures="", visible=True)
        if not self.terminal:
            self.console.print(f"{title}: {done} of {total}", highlight=False)

    def advance(self) -> None:
        """One step of the task is done."""
        self.bar.advance(self._task)

    def line(self, row: Row) -> None:
        """A line of the log."""
        shown = (*(name for name in row if name not in (*_HIDDEN, *_LAST)), *_LAST)
        figures = " ".join(f"{name} {row[name]:.4g}" for name in shown if _told(row.get(name)))
        self.bar.update(self._task, figures=figures)
        if not self.terminal:
            self.console.print(f"{row['phase']} {row['step']}: {figures}", highlight=False, soft_wrap=True)
        self._to_board("train", row)

    def validation(self, found: Sequence[Validation], total: int) -> None:
        """The figures of a validation."""
        for each in found:
            figures = {
                f"recall {each.recall:.3f}": each.recall,
                f"inlier ratio {each.inlier_ratio:.3f}": each.inlier_ratio,
                f"PIR {each.pir:.3f}": each.pir,
                f"{each.rre_deg:.2f} deg": each.rre_deg,
                f"{each.rte_m:.2f} m": each.rte_m,
                f"mask F1 {each.mask_f1:.3f}": each.mask_f1,
            }
            # A network without superpoints has no PIR, one without a mask no F1.
            told = ", ".join(text for text, value in figures.items() if _told(value))
            self.console.print(
                f"validation at {total}, {each.title}: {told}",
                highlight=False,
                soft_wrap=True,
            )
            self._to_board(f"val/{each.title}", {"total": total, **vars(each)})

    def _to_board(self, group: str, row: Row) -> None:
        if self.board is None:
            return
        for name, value in row.items():
            if isinstance(value, float) and _told(value):
                try:
                    self.board.add_scalar(f"{group}/{name}", value, row["total"])
                except OSError as error:  # a full disk: the curves are optional
                    self.console.print(f"TensorBoard's curves end here: {error}", highlight=False)
                    self.board = None
                    return


def _told(value: Any) -> bool:
    return isinstance(value, (int, float)) and not math.isnan(value)


def _board(folder: Path) -> Any:
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ImportError:
        return None
    return SummaryWriter(folder / "tensorboard")
