# SPDX-License-Identifier: MIT
"""Training data: sources, prepared pairs, augmentation, order."""
