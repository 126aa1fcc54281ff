# SPDX-License-Identifier: MIT
"""Optimal transport with a slack row and column by Sinkhorn's iteration, in two forms (docs/methods.md 8.3, 8.4)."""

from __future__ import annotations

from typing import Literal

import torch
from torch import Tensor, nn

_MINUS_INFINITY = -1e12
_TINY = 1e-38
# Potentials that change by more than a factor e^40 leave too little of float32's range.
_MAX_CHANGE = 40.0
# No iteration changes log potentials more than the one before (log-sum-exp is 1-Lipschitz): once they move by
# less than this, a hundred more iterations change nothing above 5e-5.
_SETTLED = 5e-7
_CHECK_EVERY = 8


class OptimalTransport(nn.Module):
    """Log-assignments of padded patch pairs; the slack score ``alpha`` is learned."""

    def __init__(self, iterations: int) -> None:
        super().__init__()
        self.iterations = iterations
        self.alpha = nn.Parameter(torch.tensor(1.0))

    def forward(
        self,
        scores: Tensor,
        rows: Tensor,
        columns: Tensor,
        form: Literal["log", "kernel"] = "log",
        iterations: int | None = None,
    ) -> Tensor:
        """Scores (B, n, m) with masks (B, n), (B, m) to log-assignments (B, n + 1, m + 1).

        A perfect match has the value 0. Entries of padded rows and columns are below -1e11. Every pair must
        have a valid row and a valid column.
        """
        solve = log_sinkhorn if form == "log" else kernel_sinkhorn
        return solve(scores, rows, columns, self.alpha, self.iterations if iterations is None else iterations)


def log_sinkhorn(scores: Tensor, rows: Tensor, columns: Tensor, alpha: Tensor, iterations: int) -> Tensor:
    """The log-domain iteration: slow, and safe for any scores."""
    padded = _with_slack(scores, rows, columns, alpha)
    log_mu, log_nu, norm = _log_marginals(rows, columns, scores.dtype)
    u, v = torch.zeros_like(log_mu), torch.zeros_like(log_nu)
    for _ in range(iterations):
        u = log_mu - torch.logsumexp(padded + v[:, None, :], dim=2)
        v = log_nu - torch.logsumexp(padded + u[:, :, None], dim=1)
    return padded + u[:, :, None] + v[:, None, :] - norm[:, None, None]


def kernel_sinkhorn(scores: Tensor, rows: Tensor, columns: Tensor, alpha: Tensor, iterations: int) -> Tensor:
    """The same by products with ``exp(scores)``, in a tenth of the time.

    The first iteration is done on logarithms and its potentials go into the kernel, which is then of the
    order of the marginals whatever the scores: only their change has to fit float32. Pairs for which it does not are
    recomputed in the log form. Iterations that would change nothing are skipped.
    """
    if len(scores) == 0 or iterations < 2:
        return log_sinkhorn(scores, rows, columns, alpha, iterations)
    start = log_sinkhorn(scores, rows, columns, alpha, 1)
    mu, nu = (marginal.exp()[:, None] for marginal in _log_marginals(rows, columns, scores.dtype)[:2])
    kernel = torch.exp(start) / (rows.sum(1) + columns.sum(1))[:, None, None]
    # A row times a matrix is five times as fast as a matrix times a column: hence a transposed copy.
    transposed = kernel.transpose(1, 2).contiguous()
    u, v = torch.ones_like(mu), torch.ones_like(nu)  # (B, 1, n + 1), (B, 1, m + 1)
    for step in range(1, iterations):
        u, before = mu / torch.bmm(v, transposed).clamp_min(_TINY), v
        v = nu / torch.bmm(u, kernel).clamp_min(_TINY)
        if step % _CHECK_EVERY == 0 and bool(((v - before).abs() <= _SETTLED * v).all()):
            break
    log_u, log_v = torch.where(mu > 0, u, 1.0).log(), torch.where(nu > 0, v, 1.0).log()
    out = start + log_u.transpose(1, 2) + log_v
    lost = torch.maximum(log_u.abs().amax((1, 2)), log_v.abs().amax((1, 2))) > _MAX_CHANGE
    if bool(lost.any()):
        out[lost] = log_sinkhorn(scores[lost], rows[lost], columns[lost], alpha, iterations)
    return out


def _with_slack(scores: Tensor, rows: Tensor, columns: Tensor, alpha: Tensor) -> Tensor:
    batch, n, m = scores.shape
    slack_column, slack_row = alpha.expand(batch, n, 1), alpha.expand(batch, 1, m + 1)
    padded = torch.cat([torch.cat([scores, slack_column], 2), slack_row], 1)
    invalid = ~(_with_true(rows)[:, :, None] & _with_true(columns)[:, None, :])
    return padded.masked_fill(invalid, _MINUS_INFINITY)


def _log_marginals(rows: Tensor, columns: Tensor, dtype: torch.dtype) -> tuple[Tensor, Tensor, Tensor]:
    n, m = rows.sum(1).to(dtype), columns.sum(1).to(dtype)
    norm = -torch.log(n + m)
    log_mu = torch.cat([norm[:, None].expand(rows.shape), (m.log() + norm)[:, None]], 1)
    log_nu = torch.cat([norm[:, None].expand(columns.shape), (n.log() + norm)[:, None]], 1)
    log_mu = log_mu.masked_fill(~_with_true(rows), _MINUS_INFINITY)
    log_nu = log_nu.masked_fill(~_with_true(columns), _MINUS_INFINITY)
    return log_mu, log_nu, norm


def _with_true(mask: Tensor) -> Tensor:
    return torch.cat([mask, mask.new_ones(len(mask), 1)], 1)
