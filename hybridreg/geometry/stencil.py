# SPDX-License-Identifier: MIT
"""The 26 neighbours of a motion with three parameters, one step of each away."""

import numpy as np

# (27, 3), including the motion itself.
NEIGHBOURS = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
