# SPDX-License-Identifier: MIT
"""One evaluator for every pipeline: predict once, score as often as needed."""

from hybridreg.eval.run.prediction import predict
from hybridreg.eval.run.row import Row
from hybridreg.eval.run.store import Predictions, read
from hybridreg.eval.score.protocols import PROTOCOLS, Protocol, protocol
from hybridreg.eval.score.scoring import Score, score
from hybridreg.eval.scored_table import Table

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
