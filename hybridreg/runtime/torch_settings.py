# SPDX-License-Identifier: MIT
"""Networks compute as torch begins, whatever the caller has set for a program of his own."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

from hybridreg.runtime.threads import Held

# Kinds of devices that may have autocast on.
_KINDS = ("cpu", "cuda", "mps", "xpu")


@contextmanager
def as_torch_begins() -> Iterator[None]:
    """Within the block new tensors are float32 and on the CPU unless told otherwise, and autocast is off."""
    import torch

    with ExitStack() as held:
        held.enter_context(_float32())
        if torch.get_default_device().type != "cpu":
            held.enter_context(torch.device("cpu"))
        for kind in _KINDS:
            if torch.is_autocast_enabled(kind):
                held.enter_context(torch.autocast(kind, enabled=False))
        yield


def _to_float32() -> Callable[[], Any]:
    import torch

    before = torch.get_default_dtype()
    torch.set_default_dtype(torch.float32)
    return lambda: torch.set_default_dtype(before)


_float32 = Held(_to_float32)
