# SPDX-License-Identifier: MIT
"""What the frozen test split holds: `python tests/data/simulate/freeze.py` writes frozen.json anew.

Run it together with a new `Tier.version` in tiers.py, never alone.

Where the processor and the libraries are those that wrote frozen.json, the bytes of both clouds and of the
camera image must be the same. Elsewhere last bits may differ in sines, products and the ray caster, so that here and
there a coordinate falls on the other side of its 4 mm grid, or a pulse is lost: the pose must then agree to a
micrometre, and 95 % of the points in a sample chosen by the points' own hashes must be the very same.
"""

from __future__ import annotations

import hashlib
import json
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from hybridreg.data.simulate import TIERS, draw, pair_number
from hybridreg.data.simulate.sensing.jpeg import decode

FROZEN = Path(__file__).with_name("frozen.json")
LIBRARIES = ("numpy", "scipy", "open3d", "embreex", "opencv-python-headless")
NUMBERS = (0, 1, 16, 49)  # pairs of each tier: the first two, the last, and one between
ONE_IN = 1024  # points of the sample


def steps(cloud: np.ndarray) -> np.ndarray:
    """Coordinates (n,3) int32 in steps of 1/256 m, the grid on which the sensors report."""
    return np.rint(cloud * 256).astype(np.int32)


def checksum(cloud: np.ndarray) -> str:
    """Of the bytes of all points in their order."""
    return hashlib.sha256(steps(cloud).astype("<i4").tobytes()).hexdigest()


def sample(cloud: np.ndarray) -> list[int]:
    """Hashes of about one in a thousand points: a point that comes or goes changes no other's hash."""
    x, y, z = steps(cloud).astype(np.int64).T
    mixed = (x * 73_856_093) ^ (y * 19_349_663) ^ (z * 83_492_791)
    mixed = (mixed ^ (mixed >> 15)) & 0x7FFFFFFF
    return sorted({int(v) for v in mixed[mixed % ONE_IN == 0]})


def fingerprint(tier: str, index: int) -> dict[str, Any]:
    """Pair `index` of `sim:test/<tier>`."""
    drawn = draw(tier, pair_number("test", 0, index))
    clouds = (drawn.source, drawn.target)
    return {
        "scene": drawn.scene,
        "sensors": [drawn.source_sensor, drawn.target_sensor],
        "T_target_source": drawn.T_target_source.tolist(),
        "overlap": drawn.overlap,
        "points": [len(cloud) for cloud in clouds],
        "checksums": [*(checksum(cloud) for cloud in clouds), hashlib.sha256(drawn.jpeg).hexdigest()],
        "samples": [sample(cloud) for cloud in clouds],
        "colour": decode(drawn.jpeg).mean(axis=(0, 1)).round(2).tolist(),
    }


def machine() -> dict[str, str]:
    """What last bits hang on."""
    return {
        "processor": _processor(),
        **{name: _installed(name) for name in LIBRARIES},
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    told = {line.partition(":")[0].strip(): line.partition(":")[2].split() for line in lines}
    # Processors of one name differ in their vector units, and ray casters choose their code by these.
    units = [flag for flag in told.get("flags", []) if flag.startswith(("avx", "amx", "fma"))]
    named = told.get("model name") or [platform.processor()]
    return " ".join([platform.machine(), *named, *sorted(units)])


def _installed(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "none"


if __name__ == "__main__":
    prints = {tier: {str(index): fingerprint(tier, index) for index in NUMBERS} for tier in TIERS}
    content = {
        "versions": {name: tier.version for name, tier in TIERS.items()},
        "machine": machine(),
        "pairs": prints,
    }
    FROZEN.write_text(json.dumps(content, indent=None, separators=(",", ":")).replace('},"', '},\n"') + "\n")
