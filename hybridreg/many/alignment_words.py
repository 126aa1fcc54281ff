# SPDX-License-Identifier: MIT
"""What speaks against clouds in one frame, in sentences."""

from __future__ import annotations

from collections.abc import Iterator

from hybridreg.many.alignment import Alignment
from hybridreg.many.links import DEGREES
from hybridreg.resolution import Tolerance


def reasons(found: Alignment) -> Iterator[str]:
    """Against its links, and against where its clouds lie."""
    for link in found.links:
        pair = f"{found.names[link.source]} -> {found.names[link.target]}"
        if link.off is not None and not link.off.within(Tolerance(DEGREES, link.metres)):
            yield (
                f"{pair} was given {link.off.metres:.2g} m and {link.off.degrees:.1f} deg away from where the clouds "
                "lie on one another, and they were believed"
            )
        if link.role == "contradicts":
            yield f"{pair} ({link.verdict}) contradicts the other links and was left out"
    for told in against_clouds(found):
        yield from told


def against_clouds(found: Alignment) -> list[list[str]]:
    """Against where each cloud lies, a list a row."""
    placed, hanging, doubted = found.placed, found.hanging, found.doubted
    reference = found.names[found.reference]

    def told(row: int, name: str) -> Iterator[str]:
        if not placed[row]:
            yield f"{name} is not placed: nothing ties it to {reference}"
        if row in hanging:
            yield f"{name} hangs on one link, which nothing confirms"
        if row in doubted:
            yield (
                f"only doubtful links, or given ones that the clouds do not confirm, join {name} to {reference}: "
                "register it with one of those, and read the reasons"
            )
        if row in found.unsure:
            yield f"{name} may lie elsewhere: with rivals of doubtful links as many agree"

    return [list(told(row, name)) for row, name in enumerate(found.names)]
