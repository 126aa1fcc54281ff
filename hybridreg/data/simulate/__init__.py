# SPDX-License-Identifier: MIT
"""Two different LiDARs and a camera over one procedural scene, with exact ground truth.

>>> from hybridreg.data import simulate
>>> labelled = next(simulate.pairs(tier="mid", seed=1))
"""

from hybridreg.data.simulate.difficulty import TIERS, Tier
from hybridreg.data.simulate.drawn import Drawn, draw
from hybridreg.data.simulate.labelled import pair, pairs, to_labelled
from hybridreg.data.simulate.sensing.overlaps import overlap
from hybridreg.data.simulate.sensing.sensors import SENSORS, Sensor
from hybridreg.data.simulate.simulated_folder import read_pair, write_pair, write_pairs
from hybridreg.data.simulate.splits import SPLITS, pair_number
from hybridreg.data.simulate.world.scenes import SCENES

__all__ = [
    "SCENES",
    "SENSORS",
    "SPLITS",
    "TIERS",
    "Drawn",
    "Sensor",
    "Tier",
    "draw",
    "overlap",
    "pair",
    "pair_number",
    "pairs",
    "read_pair",
    "to_labelled",
    "write_pair",
    "write_pairs",
]
