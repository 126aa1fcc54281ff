# SPDX-License-Identifier: MIT
"""Generate the pair that ships in hybridreg/data/demo: a MEMS fan against a 64-beam spinning LiDAR.

python -m tools.simulator_demo

The shipped pair was made by version 1 of the simulator; another version makes another pair.
"""

from __future__ import annotations

from pathlib import Path

from hybridreg.data import simulate
from hybridreg.data.simulate.labelled import pair_id

TIER = "near"
SPLIT = "val"
SEED = 7
INDEX = 0
VOXEL = 0.25  # metres


def main() -> None:
    """Draw, thin, write."""
    drawn = simulate.draw(
        TIER,
        simulate.pair_number(SPLIT, SEED, INDEX),
        simulate.SENSORS["mems-fan"],
        simulate.SENSORS["hdl64e"],
    )
    facts = {
        "id": pair_id(SPLIT, TIER, SEED, INDEX),
        "made_by": "python -m tools.simulator_demo",
        "tier": TIER,
        "split": SPLIT,
        "seed": SEED,
        "index": INDEX,
        "image": "image.jpg",
    }
    folder = Path(__file__).resolve().parent.parent / "hybridreg" / "data" / "demo"
    print(simulate.write_pair(folder, drawn, facts, VOXEL))


if __name__ == "__main__":
    main()
