# SPDX-License-Identifier: MIT
"""A whole run: processes, data, network, loop, card."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import torch

from hybridreg.io.lock import folder_lock
from hybridreg.learned.network_table import DEFAULT
from hybridreg.learned.training import checkpoint
from hybridreg.learned.training.card import make_card, write_card
from hybridreg.learned.training.checkpoint import Progress
from hybridreg.learned.training.data.data_choice import require_data
from hybridreg.learned.training.data.opened_source import OpenedSource
from hybridreg.learned.training.data.pair_source import open_source
from hybridreg.learned.training.data.preparing import prepare_all
from hybridreg.learned.training.data.training_examples import open_examples
from hybridreg.learned.training.initial_weights import first_network
from hybridreg.learned.training.loop import CHECKPOINT, Loop, count_parameters
from hybridreg.learned.training.processes import in_a_group, leave_group, start_processes
from hybridreg.learned.training.recipe import Recipe, Source
from hybridreg.learned.training.record import Record
from hybridreg.learned.training.reporting import Reporter
from hybridreg.learned.training.resuming import check_same, tell_changed_data
from hybridreg.learned.training.stop_flag import StopFlag, stop_on_signals
from hybridreg.runtime.workers import end_with

if TYPE_CHECKING:
    from lightning_fabric import Fabric


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """Options of a run besides its recipe.

    Attributes
    ----------
    out : folder of the run
    cache : folder of prepared pairs, shared by runs
    resume : continue from the checkpoint in ``out``
    devices, accelerator : as Lightning Fabric takes them; ``torchrun`` overrides the number
    workers : processes that prepare pairs
    """

    out: Path
    cache: Path
    resume: bool = False
    devices: int = 1
    accelerator: str = "auto"
    workers: int = 1


def train(recipe: Recipe, options: RunOptions, flag: StopFlag | None = None) -> Path | None:
    """Train a network; the folder of the best weights, or None where the run was stopped before its end.

    Parameters
    ----------
    flag : receives the signal that stopped it

    Raises
    ------
    FileExistsError
        ``out`` already holds a run, and ``resume`` is false.
    InUse
        Another process is training into ``out``.
    ValueError, FileNotFoundError
        Data that cannot be opened, or a checkpoint of another recipe.
    OSError
        A full disk, a folder that cannot be written to; the last checkpoint is whole.
    """
    require_data(recipe)
    before = _before(recipe, options)
    parent = os.getppid()
    callers = in_a_group()
    fabric = start_processes(options.devices, options.accelerator, recipe.precision)
    if not fabric.is_global_zero or "TORCHELASTIC_RUN_ID" in os.environ:
        end_with(parent)  # otherwise it would wait for the others for hours
    options.out.mkdir(parents=True, exist_ok=True)
    with folder_lock(options.out) if fabric.is_global_zero else nullcontext():
        result = _train(recipe, options, before, fabric, flag)
    if not callers:
        leave_group()
    return result


def _train(
    recipe: Recipe, options: RunOptions, before: dict[str, Any], fabric: Fabric, flag: StopFlag | None
) -> Path | None:
    quiet = not fabric.is_global_zero
    with Reporter(options.out, quiet=quiet) as reporter, torch.random.fork_rng(devices=[]):
        training = _sources(recipe, recipe.data.train, options, fabric, reporter)
        val = _sources(recipe, recipe.data.val, options, fabric, reporter)
        network = first_network(recipe)
        if before:
            tell_changed_data(before.get("data", {}), {source.title: source.content for source in training})
            network.load_state_dict(before["network"])
        fabric.to_device(network)
        progress = before["progress"] if before else Progress()
        record = Record(
            options.out,
            progress,
            val,
            reporter,
            writes=not quiet,
            log_every=recipe.log_every,
            losses=network.loss_names,
            total=partial(_total, fabric) if fabric.world_size > 1 else None,
        )
        # While pairs are being prepared a signal ends the process at once: prepared pairs are on disk.
        with stop_on_signals(flag) as stop:
            loop = Loop(fabric, recipe, network, training, options.out, record, stop)
            if not loop.run(before.get("optimizer")):
                return None
        if fabric.is_global_zero:
            figures = (record.validations, count_parameters(network), _device_name(fabric))
            write_card(options.out / "best", make_card(recipe, progress, training, val, *figures))
    return options.out / "best"


def _before(recipe: Recipe, options: RunOptions) -> dict[str, Any]:
    path = options.out / CHECKPOINT
    if options.resume:
        content = checkpoint.load(path)
        check_same(recipe.to_dict(), content["recipe"], content["progress"].phase)
        return content
    if path.exists():
        raise FileExistsError(
            f"{options.out} already holds a run: continue with --resume, or name another folder"
        )
    return {}


def _sources(
    recipe: Recipe, wanted: Sequence[Source], options: RunOptions, fabric: Fabric, reporter: Reporter
) -> list[OpenedSource]:
    opened: list[OpenedSource] = []
    for source in wanted:
        found = _opened(source, recipe, options.cache, told=fabric.is_global_zero)
        found = replace(found, fingerprints=fabric.broadcast(found.fingerprints))
        if fabric.is_global_zero:
            reporter.begin(f"preparing {found.title}", len(found))
            found = prepare_all(found, options.workers, reporter.advance)
        usable = fabric.broadcast(found.usable)
        opened.append(found.only(usable))
    return opened


def _opened(source: Source, recipe: Recipe, cache: Path, *, told: bool) -> OpenedSource:
    return (open_source if recipe.kind == DEFAULT else open_examples)(source, recipe, cache, told=told)


def _total(fabric: Fabric, values: torch.Tensor) -> torch.Tensor:
    # Apple's GPUs have no float64.
    kept = values.float() if fabric.device.type == "mps" else values
    summed = fabric.all_reduce(kept.to(fabric.device), reduce_op="sum")
    assert isinstance(summed, torch.Tensor)
    return summed.cpu()


def _device_name(fabric: Fabric) -> str:
    device = fabric.device
    name = torch.cuda.get_device_name(device) if device.type == "cuda" else "CPU"
    return f"{fabric.world_size} x {name}"
