"""Markers: tests that are slow, and tests that need an FMU that not everybody has. Imports pytest only."""

from __future__ import annotations

import pytest

LINES = (
    "fmu_slow: takes long; skipped unless --fmu-slow is given",
    "fmu_vendor(path): needs this file, relative to the test file; skipped where it is absent, unless "
    "--fmu-vendor=require",
)


def register(config: pytest.Config) -> None:
    """Make the markers known, so that --strict-markers accepts them.

    Args:
        config: of the session.
    """
    for line in LINES:
        config.addinivalue_line("markers", line)


def skip_slow(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Skip tests marked ``fmu_slow`` unless ``--fmu-slow`` is given.

    Args:
        config: of the session. items: collected tests.
    """
    if config.getoption("--fmu-slow"):
        return
    for item in items:
        if item.get_closest_marker("fmu_slow") is not None:
            item.add_marker(pytest.mark.skip(reason="slow; run it with --fmu-slow"))


def demand_vendor_files(item: pytest.Item) -> None:
    """Skip a test marked ``fmu_vendor(path)`` where a file is absent, or fail it with ``--fmu-vendor=require``.

    Args:
        item: the test.
    """
    for marker in item.iter_markers("fmu_vendor"):
        if not marker.args:
            pytest.fail("the marker fmu_vendor needs a path: @pytest.mark.fmu_vendor('vendor.fmu')", pytrace=False)
        for stated in marker.args:
            if (item.path.parent / stated).is_file():
                continue
            if item.config.getoption("--fmu-vendor") == "require":
                pytest.fail(f"the vendor file {stated} is absent (--fmu-vendor=require)", pytrace=False)
            pytest.skip(f"the vendor file {stated} is absent")
