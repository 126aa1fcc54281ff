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

from benchmarks.hostile.damage import Damage, damaged, damages
from benchmarks.hostile.mutate import Change, changed, changes

FILES = ("config.json", "model.safetensors", "checkpoint.pth.tar")


@dataclass(frozen=True, kw_only=True)
class WeightsCase:
    """One file of a network's folder, changed."""

    kind: ClassVar[str] = "weights"
    allowed: ClassVar[tuple[type[BaseException], ...]] = (ValueError, FileNotFoundError)

    file: str
    change: tuple[Change, ...] = ()
    damage: tuple[Damage, ...] = ()

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
    )


@cache
def _saved() -> dict[str, bytes]:
    import torch

    from hybridreg.learned.network import RegistrationNetwork
    from hybridreg.learned.official_names import official_name
    from hybridreg.learned.sizes import named_config
    from hybridreg.learned.weights import save_pretrained

    with tempfile.TemporaryDirectory() as name:
        network = RegistrationNetwork(named_config("nano"))
        save_pretrained(network, name)
        state = {official_name(key): value for key, value in network.state_dict().items()}
        torch.save({"model": state}, Path(name) / FILES[2])
        return {file.name: file.read_bytes() for file in Path(name).iterdir()}
