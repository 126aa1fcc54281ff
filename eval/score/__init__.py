# SPDX-License-Identifier: MIT
"""From stored rows to scores."""
