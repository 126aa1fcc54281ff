# SPDX-License-Identifier: MIT
"""The machine and the packages on it: cores, threads, processes, memory, optional packages."""
