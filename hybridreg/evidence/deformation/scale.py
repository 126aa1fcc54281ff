# SPDX-License-Identifier: MIT
"""Does the source fit better at another scale? With a wrong unit or a stretched map no rigid pose is right."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.deformation.deformed import Onto, fit
from hybridreg.evidence.surface_distance import closeness
from hybridreg.evidence.views import Views
from hybridreg.geometry import se3
from hybridreg.resolution import Tolerance

Array = NDArray[np.float64]

# One strain: the size.
_ALIKE = np.eye(3)[None]
# Scales beyond this are no small error, and are not looked for here; by hand.
_MOST = 1.25
# Scales nearer to 1 than this are noise: of 38 right poses, real and simulated, four differ by more, and none of these
# lies closer at that scale.
_LEAST = 0.01
# Nats per point that a size must gain for it to matter whether it is explained otherwise: by hand.
_TOLD = 0.05


class Size(NamedTuple):
    """`scale` to multiply the source by, how many nats per point more closely it then lies on the target (0 where that
    is no gain, or the size is as good as 1), and how far `off` the pose is from there."""

    scale: float = 1.0
    gain: float = 0.0
    off: Tolerance = Tolerance(0.0, 0.0)


def size(views: Views, T_target_source: Array, close: float, explained: Callable[[Array], bool]) -> Size:
    """Size at which the source fits best about a pose (4, 4) whose closeness is `close`, unless that is `explained`
    otherwise."""
    fitted = fit(Onto.target(views), T_target_source, _ALIKE).T
    scale = float(np.cbrt(np.linalg.det(fitted[:3, :3])))
    if not _LEAST < abs(np.log(max(scale, 1e-9))) < np.log(_MOST):
        return Size()
    gain = closeness(views.fine, fitted) - close
    if gain <= 0.0 or (gain > _TOLD and explained(fitted)):
        return Size()
    middle = views.middle
    turn = se3.project(fitted[:3, :3])
    there = se3.from_rt(turn, (se3.apply(fitted, middle) - middle @ turn.T)[0])
    return Size(scale, gain, Tolerance.between(T_target_source, there, se3.apply(T_target_source, middle)[0]))
