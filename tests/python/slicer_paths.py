# SPDX-License-Identifier: GPL-3.0-or-later
"""Puts the Slicer module's folder on Python's path, as Slicer does with "Additional module paths"."""
import sys

from conftest import SOURCE

MODULE = SOURCE / "client" / "slicer" / "Brainshift"
sys.path.insert(0, str(MODULE))
