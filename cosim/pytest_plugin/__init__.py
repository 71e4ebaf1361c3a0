"""pytest plugin: the fixture `fmu_regression`, markers for slow and vendor tests, baselines checked and written.

pytest loads this at every start, for every project in whose environment the package is, so it imports pytest and the
standard library only; what runs and compares is loaded when the fixture is first called.
"""

from __future__ import annotations

import os

import pytest

from cosim.process import exit_guard
from cosim.pytest_plugin import finish, markers, options, startup
from cosim.pytest_plugin.fixture import FmuRegression
from cosim.pytest_plugin.records import Records

__all__ = ["FmuRegression", "fmu_regression"]

_ERROR_STREAM: pytest.StashKey[int] = pytest.StashKey()
"""As it was before pytest captured it: what an FMU did that ends the session must be seen."""


def pytest_addoption(parser: pytest.Parser, pluginmanager: pytest.PytestPluginManager) -> None:
    """Add the options ``--fmu-...`` and their settings.

    Args:
        parser: of the options. pluginmanager: of pytest.
    """
    options.add(parser)
    startup.leave_as_it_is(pluginmanager)


def pytest_configure(config: pytest.Config) -> None:
    """Register the markers.

    Args:
        config: of the session.
    """
    markers.register(config)
    config.stash[_ERROR_STREAM] = exit_guard.report_to_copy_of_stderr()


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: object) -> None:
    """Pass a worker of pytest-xdist where it is to leave what it found; only the controller writes baselines.

    Args:
        node: a worker of pytest-xdist.
    """
    Records.of(node.config).share_with(node)  # type: ignore[attr-defined]


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Skip slow tests unless they are asked for.

    Args:
        config: of the session. items: collected tests.
    """
    markers.skip_slow(config, items)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip a test whose vendor FMU is not here, or fail it where it is demanded.

    Args:
        item: the test.
    """
    markers.demand_vendor_files(item)


@pytest.fixture
def fmu_regression(request: pytest.FixtureRequest) -> FmuRegression:
    """Run an FMU or a scenario and compare its outputs with the baseline of this test; see `FmuRegression`.

    Args:
        request: of the test.
    """
    return FmuRegression(request)


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """Write what ``--fmu-baseline=update`` asks for, if no test failed.

    Args:
        session: of pytest. exitstatus: of the tests.
    """
    finish.write_baselines(session, exitstatus)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Report what was checked, what differs, what was written.

    Args:
        terminalreporter: where the summary goes. config: of the session.
    """
    finish.report(terminalreporter, config)


def pytest_unconfigure(config: pytest.Config) -> None:
    """Remove what was left for the controller.

    Args:
        config: of the session.
    """
    Records.of(config).remove()
    os.close(config.stash[_ERROR_STREAM])
