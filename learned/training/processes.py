# SPDX-License-Identifier: MIT
"""Devices and processes, through Lightning Fabric."""

from __future__ import annotations

import os
from datetime import timedelta
from typing import TYPE_CHECKING, Literal

import torch

if TYPE_CHECKING:
    from lightning_fabric import Fabric

# Preparing a large data set keeps the other processes waiting.
_PATIENCE = timedelta(hours=12)


def start_processes(devices: int, accelerator: str, precision: Literal["32-true", "bf16-mixed"]) -> Fabric:
    """Join or start the processes of a run: those of ``torchrun`` where it started us, otherwise ``devices`` of them.

    More processes than GPUs share them: one pair at a time leaves most of a GPU idle.

    Raises
    ------
    ImportError
        Lightning Fabric is not installed.
    ValueError
        An accelerator that is not here.
    """
    _check_accelerator(accelerator)
    try:
        from lightning_fabric import Fabric
        from lightning_fabric.strategies import DDPStrategy, Strategy
    except ImportError as error:
        raise ImportError("training needs Lightning Fabric: pip install 'hybridreg[train]'") from error
    local = int(os.environ.get("LOCAL_WORLD_SIZE", devices))
    world = int(os.environ.get("WORLD_SIZE", local))
    cards = torch.cuda.device_count() if accelerator in ("auto", "cuda", "gpu") else 0
    shared = _round_robin(local, cards) if 0 < cards < local else None
    strategy: Strategy | str = "auto"
    if shared:  # NCCL refuses two processes on one GPU
        strategy = DDPStrategy(parallel_devices=shared, process_group_backend="gloo", timeout=_PATIENCE)
    elif world > 1:
        strategy = DDPStrategy(timeout=_PATIENCE)
    fabric = Fabric(
        accelerator=accelerator,
        devices="auto" if shared else local,
        num_nodes=max(1, world // local),
        strategy=strategy,
        precision=precision,
    )
    fabric.launch()
    return fabric


def in_a_group() -> bool:
    """Whether this process belongs to a group of processes already."""
    return torch.distributed.is_available() and torch.distributed.is_initialized()


def leave_group() -> None:
    """Leave the group of processes, once all are done. Fabric leaves gloo's to the end of the interpreter, which its
    threads may abort (torch 2.13.0, seen once)."""
    if in_a_group():
        torch.distributed.barrier()
        torch.distributed.destroy_process_group()


def _check_accelerator(accelerator: str) -> None:
    here = {"cuda": torch.cuda.is_available(), "mps": torch.backends.mps.is_available()}
    if not {**here, "gpu": any(here.values())}.get(accelerator, True):
        raise ValueError(f"accelerator={accelerator!r}: torch finds none here; use accelerator='cpu'")


def _round_robin(processes: int, cards: int) -> list[torch.device]:
    return [torch.device("cuda", place % cards) for place in range(processes)]
