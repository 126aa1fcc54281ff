# SPDX-License-Identifier: MIT
"""Compare our network with a recording of the original: ``python tests/conformance/run.py STEM``.

STEM names STEM.json, STEM.npz and STEM_weights.npz; a bare name, those in the folder of the recordings. Exit 0 when
every recorded output is within its tolerance.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
# One folder a network; what several of them need lies beside this file.
sys.path[:0] = [
    str(HERE),
    *(str(each) for each in sorted(HERE.iterdir()) if each.is_dir()),
    str(HERE.parents[1]),
]

# A key that the plan of this network alone has. The module `recorded_NETWORK` offers `compare(stem)`: for every
# recorded output its largest difference and the tolerance.
MARKS = {
    "geotransformer": "superpoint_correspondences",
    "fcgf": "tr_channels",
    "omnet": "mask_delay",
    "predator": "gnn",
    "cofinet": "coarse_selection",
    "roitr": "decoder_heads",
    "vrhcf": "descriptor",
}


def network_of(stem: Path) -> str:
    """Which network a recording is of, by its plan."""
    plan = json.loads(stem.with_name(f"{stem.name}.json").read_text())
    found = [network for network, mark in MARKS.items() if mark in plan]
    if len(found) != 1:
        raise ValueError(f"{stem.name}.json is the plan of none of {', '.join(MARKS)}")
    return found[0]


def _found(stem: Path) -> Path:
    own = (
        Path(os.environ.get("HYBRIDREG_CONFORMANCE", HERE.parents[2] / "shared" / "data" / "conformance"))
        / stem
    )
    return own if not stem.with_name(f"{stem.name}.json").exists() and own.parent.is_dir() else stem


def main(argv: list[str] | None = None) -> int:
    """Print the largest difference of each output; 1 when any exceeds its tolerance."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("stem", type=Path)
    stem = _found(parser.parse_args(argv).stem)
    found = importlib.import_module(f"recorded_{network_of(stem)}").compare(stem)
    failed = [name for name, (value, tolerance) in found.items() if not value <= tolerance]
    for name, (value, tolerance) in found.items():
        print(f"{name:42s} {value:.2e} of {tolerance:g}  {'TOO FAR' if name in failed else 'ok'}")
    print(
        f"{len(found) - len(failed)} of {len(found)} within tolerance"
        + (f"; not: {failed}" if failed else "")
    )
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
