# SPDX-License-Identifier: Apache-2.0
"""All boards, in the order of the pages."""

from constraints import colorlight_i9, ulx3s

__all__ = ["BOARDS"]

BOARDS = (*ulx3s.BOARDS, *colorlight_i9.BOARDS)
