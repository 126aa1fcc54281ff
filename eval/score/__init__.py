# SPDX-License-Identifier: MIT
"""From kept rows to scores."""
