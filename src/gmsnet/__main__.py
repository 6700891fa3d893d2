"""``python -m gmsnet``."""

import sys

from gmsnet.cli import program

sys.exit(program())
