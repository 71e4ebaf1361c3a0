"""Makes the FMUs that lie importable, which the tests of the check build."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[2] / "fmus"))
