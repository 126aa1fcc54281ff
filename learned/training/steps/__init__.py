# SPDX-License-Identifier: MIT
"""One optimiser step: losses, gradients, rate."""
