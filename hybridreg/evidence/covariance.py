# SPDX-License-Identifier: MIT
"""How far off a right pose may be, and in which directions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.resolution import VEHICLES, Tolerance

Array = NDArray[np.float64]

# The distance, metres, that makes the information's inverse an honest covariance: neighbouring points err together
# and surfaces are not planes, so that it is ten times a sensor's noise. Of 105 right "ok" poses on `sim:val` (all
# tiers) 95 % lie within the 95 % ellipsoid of six degrees of freedom, 93 % within that of 90 %, 76 % within that of
# 50 %: too wide in the middle, as the errors have longer tails than a normal distribution. Fitted to one half of the
# poses it holds 93 to 96 % of the other. Where the scene, and so the tolerance, is smaller, it shrinks with them.
NOISE = 0.19
# No pose is known better than this, however many points say so.
FLOOR_RADIANS, FLOOR_METRES = 1e-4, 1e-3


def of_information(information: Array, tolerance: Tolerance = VEHICLES) -> Array:
    """Covariance (6, 6) of a pose, rotation (radians) before translation (metres).

    Parameters
    ----------
    information : (6, 6)
        Sum of J^T J of point-to-plane distances; a direction that it leaves open is infinitely uncertain along the
        diagonal.
    tolerance : Tolerance
        The pair's, which tells the size of the scene.
    """
    size = tolerance.metres / VEHICLES.metres
    values, vectors = np.linalg.eigh(information)
    open_ = values <= 1e-12 * max(float(values.max()), 1e-300)
    spread = np.where(open_, 0.0, (size * NOISE) ** 2 / np.where(open_, 1.0, values))
    covariance: Array = (vectors * spread) @ vectors.T
    covariance += np.diag(np.repeat([FLOOR_RADIANS**2, (size * FLOOR_METRES) ** 2], 3))
    if open_.any():
        loose = (vectors[:, open_] ** 2).sum(axis=1) > 1e-6
        covariance[loose, loose] = np.inf
    return covariance
