# SPDX-License-Identifier: MIT
"""Evaluation protocols: when a pair counts as a success, and over which pairs an error is averaged."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

# Over all pairs; over successes; each error over the pairs that meet its own threshold.
Average = Literal["all", "success", "criterion"]


@dataclass(frozen=True, kw_only=True)
class Protocol:
    """One evaluation protocol (docs/methods.md 1.4).

    Attributes
    ----------
    rre_deg, rte_m : float
        A success has smaller errors than these, strictly.
    inlier_m : float
        A match is an inlier when its residual under the true pose is below this, metres.
    average : which pairs the two headline errors are averaged over
    rmse_m : float or None
        Where given, a success is an RMSE over the overlap smaller than this; the other errors are only reported.
    source : str
        Where the rule comes from.
    """

    name: str
    rre_deg: float
    rte_m: float
    inlier_m: float
    average: Average
    source: str
    rmse_m: float | None = None

    def describe(self) -> str:
        """The rule in words, for a caption."""
        rule = (
            f"RMSE < {self.rmse_m:g} m"
            if self.rmse_m
            else f"RRE < {self.rre_deg:g}° and RTE < {self.rte_m:g} m"
        )
        over = {
            "all": "all pairs",
            "success": "successes",
            "criterion": "pairs that meet that error's threshold",
        }
        return (
            f"protocol {self.name}: success {rule}, inliers within {self.inlier_m:g} m, "
            f"means over {over[self.average]}"
        )


_ALL = (
    Protocol(
        name="cross3dreg", rre_deg=2.0, rte_m=0.5, inlier_m=1.0, average="all",
        source="arXiv 2509.06456; means over all pairs follow from its printed errors",
    ),
    Protocol(
        name="kitti", rre_deg=5.0, rte_m=2.0, inlier_m=1.0, average="success",
        source="GeoTransformer, eval.py for KITTI odometry",
    ),
    Protocol(
        name="predator", rre_deg=5.0, rte_m=2.0, inlier_m=1.0, average="criterion",
        source="Predator, CoFiNet and FCGF, testers for KITTI",
    ),
    Protocol(
        name="kitti-strict", rre_deg=5.0, rte_m=0.6, inlier_m=1.0, average="success",
        source="Deep Global Registration, thresholds for KITTI",
    ),
    Protocol(
        name="fine", rre_deg=1.0, rte_m=0.3, inlier_m=0.5, average="success",
        source="about twice the error of the real pairs' ground truth",
    ),
    Protocol(
        name="3dmatch-rmse", rre_deg=15.0, rte_m=0.3, inlier_m=0.1, average="success", rmse_m=0.2,
        source="3DMatch benchmark, registration recall by RMSE over the true overlap",
    ),
    Protocol(
        name="3dcsr", rre_deg=15.0, rte_m=0.3, inlier_m=0.1, average="success",
        source="VRHCF on the indoor cross-source pairs of 3DCSR",
    ),
)  # fmt: skip

PROTOCOLS = {protocol.name: protocol for protocol in _ALL}

# Radii at which the inlier ratio is stored, so that every protocol can be scored later.
INLIER_RADII = (0.05, 0.1, 0.2, 0.3, 0.5, 0.6, 1.0, 2.0)

# Recall is always reported at these, whatever the protocol.
RECALL_AT = ((2.0, 0.5), (5.0, 2.0), (5.0, 0.6))


def protocol(name: str) -> Protocol:
    """Protocol of a name.

    Raises
    ------
    KeyError
        A name that does not exist; it lists those that do.
    """
    if name not in PROTOCOLS:
        raise KeyError(f"no protocol is called {name!r}. Known: {', '.join(PROTOCOLS)}")
    return PROTOCOLS[name]
