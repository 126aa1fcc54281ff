# SPDX-License-Identifier: MIT
"""The errors that OMNet's authors report (loss/loss.py 55-100, common/manager.py)."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]


def pose_errors(estimated: Array, true: Array, euler: Literal["xyz", "zyx"]) -> dict[str, float]:
    """Means over a batch of poses (B, 3, 4).

    The published numbers take the root of ``R_MSE`` and ``t_MSE`` after the mean over the data set. They are not
    comparable between the two ModelNet styles, whose Euler angles are in a different order.

    Parameters
    ----------
    euler
        "zyx" for data sets in PRNet's style, "xyz" for others (fixed axes).

    Returns
    -------
    dict
        ``R_MSE`` (degrees squared) and ``R_MAE`` (degrees) of the Euler angles, ``t_MSE`` and ``t_MAE`` of the
        translation's components; ``Err_R`` (degrees), the angle of the remaining rotation, ``Err_t``, the length of the
        translation's error, and ``score`` = 0.01 ``Err_R`` + ``Err_t``, by which checkpoints were chosen.
    """
    turns = [Rotation.from_matrix(pose[:, :, :3]) for pose in (estimated, true)]
    angles = turns[0].as_euler(euler, degrees=True) - turns[1].as_euler(euler, degrees=True)
    shift = estimated[:, :, 3] - true[:, :, 3]
    turn = float(np.degrees((turns[1].inv() * turns[0]).magnitude()).mean())
    length = float(np.linalg.norm(shift, axis=1).mean())
    return {
        "R_MSE": float(np.square(angles).mean()),
        "R_MAE": float(np.abs(angles).mean()),
        "t_MSE": float(np.square(shift).mean()),
        "t_MAE": float(np.abs(shift).mean()),
        "Err_R": turn,
        "Err_t": length,
        "score": 0.01 * turn + length,
    }
