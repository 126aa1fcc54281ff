# SPDX-License-Identifier: MIT
"""The command `hybridreg`."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from hybridreg.runtime.garbage import collect_seldom


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line; leaves by SystemExit: 0 done, 2 bad input, 3 the verdict is "failed", 128 + n stopped by
    signal n."""
    collect_seldom()
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
