# SPDX-License-Identifier: MIT
"""CoFiNet (Yu et al. 2021): superpoints matched by optimal transport, then the points of their patches."""
