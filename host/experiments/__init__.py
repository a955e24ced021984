# SPDX-License-Identifier: Apache-2.0
"""Experiments on the simulated machine that anybody can repeat."""
