# SPDX-License-Identifier: Apache-2.0
"""Where the project lies: the host works from a clone of it."""

from pathlib import Path

__all__ = ["ROOT"]

ROOT = Path(__file__).parents[1]
