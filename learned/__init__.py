# SPDX-License-Identifier: MIT
"""Networks, one folder each, and what they share: layers, pyramid, matching, losses, stages, training."""
