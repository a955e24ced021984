# SPDX-License-Identifier: Apache-2.0
"""The link to a controller: bytes, lines, tape frames, ports."""
