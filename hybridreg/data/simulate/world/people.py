# SPDX-License-Identifier: MIT
"""People who stand and walk, some with a bicycle or a pram."""

from __future__ import annotations

import numpy as np

from hybridreg.data.simulate.world.furniture import muted
from hybridreg.data.simulate.world.mesh import Mesh
from hybridreg.data.simulate.world.solids import ellipsoid, tubes


def person(rng: np.random.Generator) -> Mesh:
    """A person of 1.2 to 1.95 m on the origin, facing +x, in the middle of a step."""
    h = float(np.clip(rng.normal(1.7, 0.14), 1.2, 1.95))
    step, swing = rng.uniform(-0.18, 0.18) * h, rng.uniform(-0.15, 0.15) * h
    hip, shoulder = 0.48 * h, 0.81 * h
    coat, trousers = muted(rng, 0.7), 0.6 * muted(rng)
    legs = tubes(
        np.array([[0, -0.09, hip], [0, 0.09, hip]]), np.array([[step, -0.1, 0], [-step, 0.1, 0]]),
        0.085, 0.055, "cloth", trousers,
    )  # fmt: skip
    arms = tubes(
        np.array([[0, -0.2, shoulder], [0, 0.2, shoulder]]),
        np.array([[-swing, -0.24, hip - 0.02], [swing, 0.24, hip - 0.02]]),
        0.055, 0.04, "cloth", coat,
    )  # fmt: skip
    torso = ellipsoid((0, 0, (hip + shoulder) / 2), (0.14, 0.22, 0.2 * h + 0.03), "cloth", coat)
    head = ellipsoid(
        (0.02, 0, 0.92 * h),
        (0.1, 0.085, 0.075 * h),
        "cloth",
        rng.choice([0.2, 0.6, 0.8]) * np.array([1, 0.8, 0.65]),
    )
    return Mesh.merge([legs, arms, torso, head])


def bicycle(rng: np.random.Generator) -> Mesh:
    """A bicycle along x."""
    tint = muted(rng)
    turn = np.linspace(0, 2 * np.pi, 11)
    rim = np.c_[0.33 * np.cos(turn), np.zeros(11), 0.34 + 0.33 * np.sin(turn)]
    wheels = [
        tubes(rim[:-1] + [x, 0, 0], rim[1:] + [x, 0, 0], 0.022, 0.022, "rubber", (0.08, 0.08, 0.08), sides=4)
        for x in (-0.52, 0.52)
    ]
    knots = np.array([[-0.52, 0, 0.34], [-0.18, 0, 0.9], [0.42, 0, 0.92], [-0.08, 0, 0.3], [0.52, 0, 0.34]])
    ends = np.array([[1, 2], [1, 3], [0, 3], [3, 2], [2, 4], [0, 1]])
    frame = tubes(knots[ends[:, 0]], knots[ends[:, 1]], 0.02, 0.02, "metal", tint, sides=4)
    bar = tubes(
        np.array([[0.4, -0.28, 1.05]]), np.array([[0.4, 0.28, 1.05]]), 0.02, 0.02, "metal", tint, sides=4
    )
    return Mesh.merge([*wheels, frame, bar])


def rider(rng: np.random.Generator) -> Mesh:
    """Somebody on a bicycle."""
    return Mesh.merge([bicycle(rng), person(rng).moved(0.0, (-0.1, 0.0, 0.25))])
