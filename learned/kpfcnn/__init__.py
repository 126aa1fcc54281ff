# SPDX-License-Identifier: MIT
"""KPFCNN, the encoder and decoder that Predator and CoFiNet share."""
