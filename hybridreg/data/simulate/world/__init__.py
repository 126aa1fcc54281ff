# SPDX-License-Identifier: MIT
"""What simulated scenes are made of."""
