# SPDX-License-Identifier: MIT
"""Compare our network with a recording of the original: ``python tests/conformance/run.py STEM``.

STEM names STEM.json, STEM.npz and STEM_weights.npz. Exit 0 when every recorded output is within 1e-4.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parents[1])]

from compare import differences  # noqa: E402
from plan import read_recording  # noqa: E402

TOLERANCE = 1e-4


def main(argv: list[str] | None = None) -> int:
    """Print the largest difference of each output; 1 when any exceeds the tolerance."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("stem", type=Path)
    found = differences(read_recording(parser.parse_args(argv).stem))
    for name, value in found.items():
        print(f"{name:42s} {value:.2e}  {'ok' if value <= TOLERANCE else 'TOO FAR'}")
    failed = [name for name, value in found.items() if not value <= TOLERANCE]
    print(
        f"{len(found) - len(failed)} of {len(found)} within {TOLERANCE:g}"
        + (f"; not: {failed}" if failed else "")
    )
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
