# SPDX-License-Identifier: MIT
"""What a training step looks at: sources, prepared pairs, augmentation, order."""
