# SPDX-License-Identifier: MIT
"""Files of `torch.save`, read without running any code that a file carries."""

from __future__ import annotations

import io
from collections import OrderedDict
from contextlib import AbstractContextManager, nullcontext
from typing import Any

from hybridreg.io.faults import fault, shorten
from hybridreg.runtime.optional_packages import load

_TRUSTED = "nothing of it was run; take the file from where its authors publish it"


def parse_torch(data: bytes, name: str) -> Any:
    """Tensors and plain containers out of the file called `name`, on the CPU.

    Raises
    ------
    ValueError
        Damaged, or with anything else inside than tensors, numbers, texts and containers of them.
    ImportError
        Without torch.
    """
    torch = load("torch", f"{name}: a file of torch's")
    try:
        with _settings():
            return torch.load(io.BytesIO(data), map_location="cpu", weights_only=True)
    except Exception as error:  # torch raises half a dozen exception types for a damaged file
        problem = f"is damaged, or nothing that can be read safely ({_reason(error)})"
        raise fault(name, problem, _TRUSTED) from error


def _settings() -> AbstractContextManager[Any]:
    # Checkpoints of 2019 keep their options in an EasyDict, a dictionary with attributes: a plain one stands in for it.
    # torch before 2.6 takes no stand-in and refuses such files.
    import torch

    try:
        return torch.serialization.safe_globals([(OrderedDict, "easydict.EasyDict")])
    except (AttributeError, TypeError, ValueError):
        return nullcontext()


def _reason(error: Exception) -> str:
    # torch's own text recommends `weights_only=False`, which is what must not be done.
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    telling = [line for line in lines if "weights_only" not in line and "documentation" not in line]
    return shorten(telling[0] if telling else type(error).__name__, 160)
