# SPDX-License-Identifier: MIT
"""From a network's tensors to the arrays that stages exchange."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from torch import Tensor


def array(tensor: Tensor) -> NDArray[np.float64]:
    """The tensor's values in float64, on the CPU."""
    values: NDArray[np.float64] = tensor.detach().cpu().double().numpy()
    return values
