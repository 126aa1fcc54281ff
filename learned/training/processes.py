# SPDX-License-Identifier: MIT
"""Devices and processes, through Lightning Fabric."""

from __future__ import annotations

import os
from datetime import timedelta
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from lightning_fabric import Fabric

# Preparing a large data set keeps the other processes waiting.
_PATIENCE = timedelta(hours=12)


def start_processes(devices: int, accelerator: str, precision: Literal["32-true", "bf16-mixed"]) -> Fabric:
    """Join or start the processes of a run: those of ``torchrun`` where it started us, else ``devices`` of them.

    Raises
    ------
    ImportError
        Lightning Fabric is not installed.
    """
    try:
        from lightning_fabric import Fabric
        from lightning_fabric.strategies import DDPStrategy, Strategy
    except ImportError as error:
        raise ImportError("training needs Lightning Fabric: pip install 'hybridreg[train]'") from error
    local = int(os.environ.get("LOCAL_WORLD_SIZE", devices))
    world = int(os.environ.get("WORLD_SIZE", local))
    strategy: Strategy | str = DDPStrategy(timeout=_PATIENCE) if world > 1 else "auto"
    fabric = Fabric(
        accelerator=accelerator,
        devices=local,
        num_nodes=max(1, world // local),
        strategy=strategy,
        precision=precision,
    )
    fabric.launch()
    return fabric
