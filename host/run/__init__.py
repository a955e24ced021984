# SPDX-License-Identifier: Apache-2.0
"""What runs on the PC: tape codec, command line, link to the machine, report of a run."""
