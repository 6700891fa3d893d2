"""``python -m gmsnet``."""

import sys

from gmsnet.cli import main

sys.exit(main())
