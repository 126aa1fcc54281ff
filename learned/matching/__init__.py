# SPDX-License-Identifier: MIT
"""From features to matches, and from matches to poses, on tensors."""
