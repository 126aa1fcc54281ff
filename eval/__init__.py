# SPDX-License-Identifier: MIT
"""One evaluator for every pipeline: predict once, score as often as wanted."""

from hybridreg.eval.prediction import predict
from hybridreg.eval.protocols import PROTOCOLS, Protocol, protocol
from hybridreg.eval.row import Row
from hybridreg.eval.scoring import Score, score
from hybridreg.eval.store import Predictions, read
from hybridreg.eval.table import Table

__all__ = [
    "PROTOCOLS",
    "Predictions",
    "Protocol",
    "Row",
    "Score",
    "Table",
    "predict",
    "protocol",
    "read",
    "score",
]
