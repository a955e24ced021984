# SPDX-License-Identifier: Apache-2.0
"""The simulated machine for programs that study it: step by step, or as a Gymnasium environment."""
