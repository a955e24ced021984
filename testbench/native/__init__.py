# SPDX-License-Identifier: Apache-2.0
"""The native simulation; ``start`` is the one function that the host's ``run`` calls."""

from testbench.native.simulation import start

__all__ = ["start"]
