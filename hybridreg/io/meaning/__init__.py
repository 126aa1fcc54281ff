# SPDX-License-Identifier: MIT
"""What numbers mean: in what unit they are, and whether they are coordinates at all."""
