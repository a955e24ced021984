# SPDX-License-Identifier: Apache-2.0
"""The simulated machine for programs that study it: by hand, and as an environment of Gymnasium."""
