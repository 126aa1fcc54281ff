# SPDX-License-Identifier: MIT
"""Names of our tensors in CoFiNet's published checkpoints."""

from __future__ import annotations

import re

from hybridreg.learned.kpfcnn.kpfcnn_names import attention_name, block_name

# In every checkpoint, but never used.
UNUSED = ("l_bin_score", "encoder.epsilon")
_BLOCKS = ("sattn1", "cattn", "sattn2")


def official_name(name: str) -> str:
    """The checkpoint's name of one tensor of our state dict."""
    part, _, rest = name.partition(".")
    if part in ("coarse", "fine"):
        prefix = "l_" if part == "fine" else ""
        rest = re.sub(r"^blocks\.(\d)\.layer", lambda match: _BLOCKS[int(match[1])], rest)
        return attention_name(prefix + re.sub(r"^project\.", "final_proj.", rest))
    if part in ("encoder", "decoder"):
        return f"{part}.{block_name(name)}"
    return re.sub(r"^bottleneck\.", "encoder.bottle.", name)
