# SPDX-License-Identifier: MIT
"""The machine and its packages: cores, threads, processes, memory, optional packages."""
