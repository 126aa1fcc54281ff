# SPDX-License-Identifier: MIT
"""Weights of a network with its configuration changed or its tensors damaged."""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import ClassVar

from hypothesis import strategies as st

from tools.hostile.damage import Damage, damaged, damages
from tools.hostile.mutate import Change, changed, changes

# The first three are fine, and drawn as often as all others.
SPOILS = (
    *("float16", "bfloat16", "float64") * 3,
    *("nan", "inf", "zeros", "int8", "int64", "bool", "float8_e4m3fn", "float8_e5m2"),
)
FILES = ("config.json", "model.safetensors", "checkpoint.pth.tar")


@dataclass(frozen=True, kw_only=True)
class WeightsCase:
    """One file of a network's folder, changed."""

    kind: ClassVar[str] = "weights"
    allowed: ClassVar[tuple[type[BaseException], ...]] = (ValueError, FileNotFoundError)

    file: str
    change: tuple[Change, ...] = ()
    damage: tuple[Damage, ...] = ()
    spoilt: tuple[int, str] | None = None  # which tensor, and what becomes of it

    def run(self) -> str:
        """Load the network."""
        from hybridreg.learned.weights import from_pretrained, load_official

        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            for file, content in _saved().items():
                (folder / file).write_bytes(content)
            content = damaged(_saved()[self.file], self.damage)
            if self.change and self.file == FILES[0]:
                content = json.dumps(changed(json.loads(content), self.change), default=str).encode()
            if self.spoilt is not None:
                content = _spoil(content, *self.spoilt)
            (folder / self.file).write_bytes(content)
            if self.file == FILES[2]:
                load_official(folder / self.file, "nano")
            else:
                from_pretrained(folder)
        return "loaded"


def cases() -> st.SearchStrategy[WeightsCase]:
    """Changed configurations, damaged files."""
    return st.one_of(
        st.builds(WeightsCase, file=st.just(FILES[0]), change=changes()),
        st.builds(WeightsCase, file=st.sampled_from(FILES), damage=damages()),
        st.builds(
            WeightsCase,
            file=st.just(FILES[1]),
            spoilt=st.tuples(st.integers(0, 500), st.sampled_from(SPOILS)),
        ),
    )


def _spoil(content: bytes, which: int, how: str) -> bytes:
    import torch
    from safetensors.torch import load, save

    tensors = load(content)
    name = sorted(tensors)[which % len(tensors)]
    made = tensors[name] * {"nan": float("nan"), "inf": float("inf"), "zeros": 0.0}.get(how, 1.0)
    tensors[name] = (
        made.to(getattr(torch, how)) if hasattr(torch, how) and how not in ("nan", "inf", "zeros") else made
    )
    return save(tensors)


@cache
def _saved() -> dict[str, bytes]:
    import torch

    from hybridreg.learned.cross3dreg.network import RegistrationNetwork
    from hybridreg.learned.cross3dreg.sizes import named_config
    from hybridreg.learned.geotransformer.official_names import official_name
    from hybridreg.learned.weights import save_pretrained

    with tempfile.TemporaryDirectory() as name:
        network = RegistrationNetwork(named_config("nano"))
        save_pretrained(network, name)
        state = {official_name(key): value for key, value in network.state_dict().items()}
        torch.save({"model": state}, Path(name) / FILES[2])
        return {file.name: file.read_bytes() for file in Path(name).iterdir()}
