# SPDX-License-Identifier: MIT
"""What a command says on the terminal, and how it ends: text, errors, signals."""
