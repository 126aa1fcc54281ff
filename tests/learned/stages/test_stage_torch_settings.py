# SPDX-License-Identifier: MIT
"""What a program of the caller's sets in torch reaches no network of ours: same bits, and networks read once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

import numpy as np
import pytest
import torch

import hybridreg as hr
from hybridreg.learned.stages.networks import forget
from hybridreg.testing import sample_pair


@contextmanager
def float64() -> Iterator[None]:
    before = torch.get_default_dtype()
    torch.set_default_dtype(torch.float64)
    try:
        yield
        assert torch.get_default_dtype() == torch.float64
    finally:
        torch.set_default_dtype(before)


SETTINGS: dict[str, Callable[[], AbstractContextManager[object]]] = {
    "float64": float64,
    "autocast": lambda: torch.autocast("cpu", dtype=torch.bfloat16),
    "another device": lambda: torch.device("meta"),
}
PIPELINES = {
    "geotransformer": hr.Pipeline.preset("geotransformer"),
    "fcgf": hr.Pipeline(match=hr.Fcgf(size="nano", untrained=True), estimate="ransac", refine="none"),
    "omnet": hr.Pipeline(match="none", estimate=hr.OmNet(size="nano", untrained=True), refine="none"),
}


@pytest.mark.parametrize("pipeline", PIPELINES)
@pytest.mark.parametrize("setting", SETTINGS)
def test_the_callers_settings_change_nothing(pipeline: str, setting: str) -> None:
    pair, _ = sample_pair()
    pipe = PIPELINES[pipeline]
    forget()
    wanted = pipe.run(pair)
    forget()
    with SETTINGS[setting]():
        within = pipe.run(pair)
    after = pipe.run(pair)  # with the network that was read within
    for found in (within, after):
        np.testing.assert_array_equal(found.transformation, wanted.transformation)
        np.testing.assert_array_equal(found.matches.source, wanted.matches.source)
    forget()


def test_a_device_may_be_torchs_own() -> None:
    assert hr.Fcgf(device=torch.device("cpu")) == hr.Fcgf(device="cpu")  # type: ignore[arg-type]


def test_a_device_that_torch_was_built_without() -> None:
    if torch.backends.mps.is_available():
        pytest.skip("there is one")
    with pytest.raises(ValueError, match=r"device='mps': .*; use device='cpu'"):
        hr.Fcgf(device="mps").network()
