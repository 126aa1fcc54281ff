# SPDX-License-Identifier: MIT
"""Many clouds in one frame, and whether to believe it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.many.links import Link, groups
from hybridreg.runtime.read_only import lock

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class Alignment:
    """What `register_all` returns.

    Attributes
    ----------
    names : tuple of str
    poses : (n, 4, 4) float64
        Each maps a cloud's points to the reference's coordinates; NaN for clouds that nothing ties to it.
    reference : int
    links : tuple of Link
        Every pair that was registered, and what became of it.
    unsure : tuple of int
        Rows of clouds that may lie elsewhere: where the rivals of doubtful links put them, as many links agree.
    reasons : tuple of str
        What speaks against the result, by name: links that contradict the others, clouds that are not placed, that hang
        on one link which nothing confirms, that only doubtful links join to the reference, or that are unsure.
    seconds : float
    """

    names: tuple[str, ...]
    poses: Array
    reference: int
    links: tuple[Link, ...]
    reasons: tuple[str, ...]
    seconds: float
    unsure: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        lock(self, "poses")

    @property
    def placed(self) -> NDArray[np.bool_]:
        """Which clouds lie in the common frame, (n,)."""
        return np.asarray(np.isfinite(self.poses).all(axis=(1, 2)))

    @property
    def verdict(self) -> str:
        """Of all together: "ok" where every cloud is placed by two links or more (of two clouds, by one) that agree, a
        chain of links that are "ok" joins it to the reference, and none may lie elsewhere; "failed" where only the
        reference is placed; else "doubtful"."""
        if self.placed.sum() < 2:
            return "failed"
        doubts = self.hanging or self.doubted or self.unsure
        return "ok" if self.placed.all() and not doubts else "doubtful"

    @property
    def hanging(self) -> list[int]:
        """Placed clouds that hang on one link, where there are more than two clouds."""
        few = self.n_links < 2
        return [] if len(self.names) < 3 else [int(k) for k in np.flatnonzero(few & self.placed)]

    @property
    def doubted(self) -> list[int]:
        """Placed clouds that no chain of links that are "ok" joins to the reference. Doubtful links between two groups
        may all be wrong alike: where the groups are two storeys of one plan, or a cloud is stretched; and so may given
        ones, of one source."""
        sure = [link for link in self._used if link.verdict == "ok"]
        joined = next(group for group in groups(len(self.names), sure) if self.reference in group)
        return [int(k) for k in np.flatnonzero(self.placed) if k not in joined]

    @property
    def _used(self) -> list[Link]:
        return [link for link in self.links if link.role in ("tree", "loop")]

    @property
    def n_links(self) -> NDArray[np.int64]:
        """How many links that agree each cloud takes part in, (n,)."""
        ends = [k for link in self._used for k in (link.source, link.target)]
        return np.bincount(np.array(ends, dtype=np.int64), minlength=len(self.names))

    def summary(self) -> str:
        """A few lines to print."""
        used = len(self._used)
        lines = [
            f"{self.verdict}: {int(self.placed.sum())} of {len(self.names)} clouds in the frame of "
            f"{self.names[self.reference]}, {used} of {len(self.links)} links agree",
            *(f"- {each}" for each in self.reasons),
        ]
        return "\n".join([*lines, f"{self.seconds:.1f} s"])

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, lists and strings."""
        return {
            "verdict": self.verdict,
            "reference": self.names[self.reference],
            "poses": {
                name: pose.tolist() if good else None
                for name, pose, good in zip(self.names, self.poses, self.placed, strict=True)
            },
            "links": [
                {
                    "source": self.names[link.source],
                    "target": self.names[link.target],
                    "T_target_source": link.T_target_source.tolist(),
                    "verdict": link.verdict,
                    "confidence": link.confidence,
                    "role": link.role,
                }
                for link in self.links
            ],
            "reasons": list(self.reasons),
            "seconds": self.seconds,
        }
