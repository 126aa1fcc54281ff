# SPDX-License-Identifier: MIT
"""The networks as stages of a pipeline. Nothing here imports torch before a stage runs."""
