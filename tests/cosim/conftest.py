"""Makes the helpers of this folder importable for the tests in its rooms; pytest puts the folder of a conftest on the
path. The FMUs that lie, which the tests of the check build, are importable as well.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "fmus"))


def pytest_sessionfinish() -> None:
    """End the browser where a test has started one."""
    if "browser" in sys.modules:  # not imported by those who run other tests: it needs playwright
        sys.modules["browser"].close_browser()
