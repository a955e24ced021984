# SPDX-License-Identifier: Apache-2.0
"""The operator's panel: a page in the browser for the person at the machine."""
