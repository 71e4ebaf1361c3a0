"""Makes the helpers of this folder importable for the tests in its rooms; pytest puts the folder of a conftest on the
path.
"""

from __future__ import annotations

import sys


def pytest_sessionfinish() -> None:
    """End the browser where a test has started one."""
    if "browser" in sys.modules:  # not imported by those who run other tests: it needs playwright
        sys.modules["browser"].close_browser()
