# SPDX-License-Identifier: MIT
"""The command `hybridreg`."""

from __future__ import annotations

import atexit
import gc
import sys
from collections.abc import Sequence

# Objects made before the garbage collector looks for cycles, and rounds before it looks among older ones: what is
# imported is no garbage, and looking takes a tenth of a short command's time.
_COLLECT_AFTER = (100_000, 50, 100)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line; leaves by SystemExit: 0 done, 2 bad input, 3 the verdict is "failed", 128 + n stopped by
    signal n."""
    gc.set_threshold(*_COLLECT_AFTER)
    atexit.register(gc.freeze)  # what goes with the process need not be searched at its end
    try:
        from hybridreg.cli.app import app
        from hybridreg.cli.terminal.console import make_ready
    except (
        ImportError,
        MemoryError,
        OSError,
    ) as error:  # too little memory even for the imports, or a broken installation
        sys.exit(f"hybridreg: {' '.join(str(error).split()) or 'not enough memory'}")
    make_ready()
    app(None if arguments is None else list(arguments))
