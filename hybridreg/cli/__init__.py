# SPDX-License-Identifier: MIT
"""The command `hybridreg`."""

from __future__ import annotations

from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line; leaves by SystemExit: 0 done, 2 bad input, 3 the verdict is "failed"."""
    from hybridreg.cli.app import app

    app(None if arguments is None else list(arguments))
