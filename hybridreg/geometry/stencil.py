# SPDX-License-Identifier: MIT
"""The neighbours of a motion with three numbers, in steps of each."""

import numpy as np

# (27, 3), the motion itself among them.
NEIGHBOURS = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
