# SPDX-License-Identifier: MIT
"""Training: recipes, prepared pairs, the loop, checkpoints and validation."""
