"""Keeps pytest fast: it would rewrite the asserts of every module of a distribution that brings a plugin."""

from __future__ import annotations

import pytest

PACKAGES = ("cosim", "fmus", "fmu_observer", "plant_models")


def leave_as_it_is(pluginmanager: pytest.PytestPluginManager) -> None:
    """Take this package off the list of what is rewritten; it holds no tests, and rewriting it takes seconds.

    The list is not part of pytest's interface; where it is not what it was (pytest 8 and 9), nothing is done.

    Args:
        pluginmanager: of pytest.
    """
    hook = getattr(pluginmanager, "rewrite_hook", None)
    marked = getattr(hook, "_must_rewrite", None)
    if isinstance(marked, set):
        marked.difference_update(PACKAGES)
