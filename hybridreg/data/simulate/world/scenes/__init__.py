# SPDX-License-Identifier: MIT
"""The kinds of scene, by name. A function `rng -> Layout` added here is a new kind."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hybridreg.data.simulate.world.layout import Layout
from hybridreg.data.simulate.world.scenes.campus import campus
from hybridreg.data.simulate.world.scenes.degenerate import corridor, open_field
from hybridreg.data.simulate.world.scenes.park import park, woods
from hybridreg.data.simulate.world.scenes.parking import parking
from hybridreg.data.simulate.world.scenes.street import street
from hybridreg.data.simulate.world.scenes.yard import yard

SCENES: dict[str, Callable[[np.random.Generator], Layout]] = {
    "street": street,
    "campus": campus,
    "parking": parking,
    "park": park,
    "woods": woods,
    "yard": yard,
    "corridor": corridor,
    "open_field": open_field,
}
USUAL = {"street": 0.32, "campus": 0.24, "parking": 0.12, "park": 0.12, "woods": 0.06, "yard": 0.14}
DEGENERATE = {"corridor": 0.5, "open_field": 0.5}
