"""The logger "hexapod_pin": what a program that uses the package may want to know of its work.

Nothing is printed unless the program configures logging.
"""

from __future__ import annotations

import logging

LOG = logging.getLogger("hexapod_pin")
LOG.addHandler(logging.NullHandler())
