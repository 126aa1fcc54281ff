# SPDX-License-Identifier: MIT
"""Two different LiDARs and a camera over one procedural scene, with exact ground truth.

>>> from hybridreg.data import simulate
>>> labelled = next(simulate.pairs(tier="mid", seed=1))
"""

from .drawn import Drawn, draw
from .folder import read_pair, write_pair, write_pairs
from .labelled import pair, pairs, to_labelled
from .overlaps import overlap
from .scenes import SCENES
from .sensors import SENSORS, Sensor
from .splits import SPLITS, VERSION, pair_number
from .tiers import TIERS, Tier

__all__ = [
    "SCENES",
    "SENSORS",
    "SPLITS",
    "TIERS",
    "VERSION",
    "Drawn",
    "Sensor",
    "Tier",
    "draw",
    "to_labelled",
    "overlap",
    "pair",
    "pair_number",
    "pairs",
    "read_pair",
    "write_pair",
    "write_pairs",
]
