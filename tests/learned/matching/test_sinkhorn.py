# SPDX-License-Identifier: MIT
"""Optimal transport: marginals, both forms, masks."""

from __future__ import annotations

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridreg.learned.matching.sinkhorn import OptimalTransport, kernel_sinkhorn, log_sinkhorn

ALPHA = torch.tensor(1.0)


def problem(seed: int, spread: float, batch: int = 5, n: int = 12, m: int = 9):  # type: ignore[no-untyped-def]
    """Scores of the given range with masks of random sizes, at least one row and column each."""
    gen = torch.Generator().manual_seed(seed)
    scores = (torch.rand(batch, n, m, generator=gen) - 0.5) * spread
    rows = torch.arange(n)[None] < torch.randint(1, n + 1, (batch, 1), generator=gen)
    columns = torch.arange(m)[None] < torch.randint(1, m + 1, (batch, 1), generator=gen)
    return scores, rows, columns


@pytest.mark.parametrize("solve", [log_sinkhorn, kernel_sinkhorn])
def test_marginals(solve) -> None:  # type: ignore[no-untyped-def]
    scores, rows, columns = problem(0, 10.0)  # slower to converge the wider the scores
    mass = solve(scores, rows, columns, ALPHA, 100).exp()
    ones = torch.ones_like(mass[:, 0, :-1])
    # scaled by m + n a point has mass 1; columns are normalised last
    assert torch.allclose(mass.sum(1)[:, :-1][columns], ones[columns], atol=1e-4)
    assert torch.allclose(mass.sum(2)[:, :-1][rows], torch.ones(int(rows.sum())), atol=1e-3)
    assert float(mass[:, :-1, :-1][~(rows[:, :, None] & columns[:, None])].abs().max()) == 0.0


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.1, 300.0), st.sampled_from([2, 20, 100]))
def test_both_forms_agree(seed: int, spread: float, iterations: int) -> None:
    scores, rows, columns = problem(seed, spread)
    exact = log_sinkhorn(scores.double(), rows, columns, ALPHA.double(), iterations).exp()
    fast = kernel_sinkhorn(scores, rows, columns, ALPHA, iterations).exp()
    assert torch.isfinite(fast).all()
    assert (fast - exact).abs().max() < 1e-4


def test_the_log_form_steps_in_for_single_pairs() -> None:
    scores, rows, columns = problem(3, 4.0)
    scores[2, 0, 0] = 900.0  # one isolated pair of huge scores
    exact = log_sinkhorn(scores.double(), rows, columns, ALPHA.double(), 50).exp()
    assert (kernel_sinkhorn(scores, rows, columns, ALPHA, 50).exp() - exact).abs().max() < 1e-4


def gradients(solve, scores: torch.Tensor, *rest, dtype: torch.dtype) -> tuple[torch.Tensor, torch.Tensor]:  # type: ignore[no-untyped-def]
    """Of a loss of log-assignments of valid entries, as in training, by the scores and by the slack."""
    rows, columns, iterations = rest
    scores, alpha = (given.detach().clone().to(dtype).requires_grad_() for given in (scores, ALPHA))
    valid = rows[:, :, None] & columns[:, None]
    out = solve(scores, rows, columns, alpha, iterations)
    (out[:, :-1, :-1][valid][::3].sum() + out[:, :-1, -1][rows].mean()).backward()
    assert scores.grad is not None
    assert alpha.grad is not None
    return scores.grad.double(), alpha.grad.double()


@pytest.mark.parametrize("spread", [0.5, 10.0, 60.0])
@pytest.mark.parametrize("iterations", [2, 10, 60])
def test_both_forms_have_the_same_gradient(spread: float, iterations: int) -> None:
    scores, rows, columns = problem(7, spread)
    exact = gradients(log_sinkhorn, scores, rows, columns, iterations, dtype=torch.float64)
    fast = gradients(kernel_sinkhorn, scores, rows, columns, iterations, dtype=torch.float32)
    for a, b in zip(exact, fast, strict=True):
        assert (a - b).abs().max() < 1e-3 * a.abs().max().clamp_min(1.0)


def test_a_pair_that_the_log_form_steps_in_for_has_its_gradient_too() -> None:
    scores, rows, columns = problem(3, 4.0)
    rows, columns = torch.ones_like(rows), torch.ones_like(columns)
    scores[2, 0, 0] = 900.0
    exact = gradients(log_sinkhorn, scores, rows, columns, 10, dtype=torch.float64)
    fast = gradients(kernel_sinkhorn, scores, rows, columns, 10, dtype=torch.float32)
    for a, b in zip(exact, fast, strict=True):
        assert torch.isfinite(b).all()
        assert (a - b).abs().max() < 1e-3 * a.abs().max().clamp_min(1.0)


def test_settled_potentials_stop_the_iteration(monkeypatch: pytest.MonkeyPatch) -> None:
    scores, rows, columns = problem(4, 2.0)
    products = []
    bmm = torch.bmm
    monkeypatch.setattr(torch, "bmm", lambda a, b: products.append(1) or bmm(a, b))  # type: ignore[func-returns-value]
    early = kernel_sinkhorn(scores, rows, columns, ALPHA, 1000)
    assert len(products) < 200
    exact = log_sinkhorn(scores.double(), rows, columns, ALPHA.double(), 1000).exp()
    assert (early.exp() - exact).abs().max() < 1e-5


@pytest.mark.parametrize("form", ["log", "kernel"])
def test_padding_changes_nothing(form: str) -> None:
    scores, rows, columns = problem(1, 10.0)
    transport = OptimalTransport(40)
    wider = torch.full((5, 15, 14), 7.0)
    wider[:, :12, :9] = scores
    pad = torch.nn.functional.pad
    got = transport(wider, pad(rows, (0, 3)), pad(columns, (0, 5)), form)
    want = transport(scores, rows, columns, form)
    valid = rows[:, :, None] & columns[:, None]
    assert torch.allclose(got[:, :12, :9][valid], want[:, :-1, :-1][valid], atol=1e-5)
    assert torch.allclose(got[:, -1, -1], want[:, -1, -1], atol=1e-5)
    assert (got[:, 12:-1] < -1e11).all()


def test_no_pairs() -> None:
    none = torch.zeros(0, 4, 4)
    mask = torch.zeros(0, 4, dtype=torch.bool)
    assert OptimalTransport(10)(none, mask, mask, "kernel").shape == (0, 5, 5)


def test_the_slack_score_learns() -> None:
    scores, rows, columns = problem(2, 2.0)
    transport = OptimalTransport(10)
    transport(scores, rows, columns)[:, 0, 0].sum().backward()
    assert transport.alpha.grad is not None
    assert torch.isfinite(transport.alpha.grad)
    assert transport.alpha.grad != 0
