"""``python -m odisar``."""

import sys

from odisar.cli import main

sys.exit(main())
