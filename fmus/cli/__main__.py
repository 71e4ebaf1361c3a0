"""``python -m fmus.cli``."""

import sys

from fmus.cli import main

sys.exit(main())
