# SPDX-License-Identifier: MIT
"""What the frozen test split holds: `python tests/data/simulate/freeze.py` writes frozen.json anew.

Run it together with a new `splits.VERSION`, never alone.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from hybridreg.data.simulate import TIERS, VERSION, draw, pair_number

FROZEN = Path(__file__).with_name("frozen.json")


def fingerprint(tier: str) -> dict[str, Any]:
    """The first pair of `sim:test/<tier>/0` in figures that survive another processor's last bits."""
    drawn = draw(tier, pair_number("test", 0, 0))
    return {
        "scene": drawn.scene,
        "sensors": [drawn.source_sensor, drawn.target_sensor],
        "T_target_source": drawn.T_target_source.tolist(),
        "overlap": drawn.overlap,
        "points": [len(drawn.source), len(drawn.target)],
        "centroids": [np.mean(c, axis=0, dtype=float).tolist() for c in (drawn.source, drawn.target)],
    }


if __name__ == "__main__":
    prints = {tier: fingerprint(tier) for tier in TIERS}
    FROZEN.write_text(json.dumps({"version": VERSION, "first": prints}, indent=1) + "\n")
