# SPDX-License-Identifier: MIT
"""Rows of a method of the user's own belong to its code and its values, though its name stays the same."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from eval_stubs import Scattered

import hybridreg as hr
from hybridreg.eval import predict
from hybridreg.eval.run.own_content import own_content

torch = pytest.importorskip("torch")


class Plain:
    def __init__(self, k: float) -> None:
        self.k, self._seen = k, 0

    def __call__(self, pair: Any, seed: int) -> np.ndarray:
        self._seen += 1
        return _moved(self.k)


def _moved(k: float) -> np.ndarray:
    T = np.eye(4)
    T[0, 3] = k
    return T


def _constant(pair: Any, seed: int, k: float = 0.0) -> np.ndarray:
    return _moved(k)


def _closure(k: float) -> Callable[[Any, int], np.ndarray]:
    return lambda pair, seed: _moved(k)


class Estimator:
    def __init__(self, k: float) -> None:
        self.k = k

    def __call__(self, scene: Any, matches: Any, rng: Any) -> hr.Pose:
        return hr.Pose(_moved(self.k))


class Net(torch.nn.Module):  # type: ignore[name-defined,misc]
    def __init__(self, k: float) -> None:
        super().__init__()
        self.layer = torch.nn.Linear(1, 1)
        with torch.no_grad():
            self.layer.weight.fill_(k)
            self.layer.bias.zero_()

    def __call__(self, scene: Any, matches: Any, rng: Any) -> hr.Pose:
        return hr.Pose(_moved(float(self.layer.weight)))


def _pipe(estimate: Any) -> hr.Pipeline:
    return hr.Pipeline(match="none", estimate=estimate, refine="none")


def _inside(k: float) -> hr.Pipeline:
    return _pipe(hr.Candidates(of=({"estimate": Estimator(k)},)))


KINDS: dict[str, Callable[[float], Any]] = {
    "class": Plain,
    "partial": lambda k: partial(_constant, k=k),
    "closure": _closure,
    "bound": lambda k: Plain(k).__call__,
    "array": lambda k: partial(_constant, k=np.array(k)),
    "stage": lambda k: _pipe(Estimator(k)),
    "network": lambda k: _pipe(Net(k)),
    "entry": _inside,
}


@pytest.mark.parametrize("kind", KINDS)
def test_another_value_is_another_method_and_the_same_one_is_the_same(kind: str, tmp_path: Path) -> None:
    make = KINDS[kind]
    assert own_content(make(1.0)) == own_content(make(1.0)) != own_content(make(2.0))
    before = predict(make(1.0), Scattered(1), tmp_path / "p.jsonl")
    assert predict(make(1.0), Scattered(1), tmp_path / "p.jsonl") == before
    with pytest.raises(ValueError, match="own_content"):
        predict(make(2.0), Scattered(1), tmp_path / "p.jsonl")


def test_other_code_of_one_name_is_another_method() -> None:
    def first(pair: Any, seed: int) -> int:
        return 1

    def second(pair: Any, seed: int) -> int:
        return 2

    second.__qualname__ = first.__qualname__
    assert own_content(first) != own_content(second)


def test_a_global_that_a_function_names_belongs_to_it(monkeypatch: pytest.MonkeyPatch) -> None:
    before = own_content(_reads)
    monkeypatch.setattr(sys.modules[__name__], "HEIGHT", 2.0)
    assert own_content(_reads) != before


HEIGHT = 1.0


def _reads(pair: Any, seed: int) -> float:
    return HEIGHT


def test_what_a_run_remembers_is_no_change() -> None:
    method = Plain(1.0)
    before = own_content(method)
    method(None, 0)
    assert own_content(method) == before


def test_what_comes_with_the_library_is_told_by_its_fields() -> None:
    assert own_content(hr.Pipeline.preset("default")) is None


def test_another_process_finds_the_same() -> None:
    code = "def f(pair, seed, kinds=frozenset({'a', 'b', 'c'})): return {'x', 'y', 'z'}\n"
    code += "from hybridreg.eval.run.own_content import own_content as c\nprint(c(f))"
    told = {
        subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True,
            text=True,
            check=True,
            env={"PYTHONHASHSEED": seed},
        ).stdout
        for seed in ("1", "2")
    }
    assert len(told) == 1
