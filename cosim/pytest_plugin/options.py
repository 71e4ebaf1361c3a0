"""The plugin's options and settings. Imports pytest only."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, cast

import pytest

Mode = Literal["check", "update", "diff"]
MODES = ("check", "update", "diff")


def add(parser: pytest.Parser) -> None:
    """Add options and settings to the parser of pytest."""
    group = parser.getgroup("fmu", "regression tests of FMUs and scenarios (fmu_regression)")
    group.addoption(
        "--fmu-baseline",
        choices=MODES,
        default="check",
        help="check (default): fail where outputs differ from the baseline; update: write baselines, if no test fails; "
        "diff: show all differences with pictures, fail on none",
    )
    group.addoption(
        "--fmu-baseline-force", action="store_true", help="with --fmu-baseline=update: write though tests failed"
    )
    group.addoption(
        "--fmu-baseline-dir",
        metavar="DIR",
        help="folder of all baselines, instead of 'baselines' beside each test file",
    )
    group.addoption(
        "--fmu-artifacts", metavar="DIR", help="folder for pictures and pages of differences (default: .pytest_fmu)"
    )
    group.addoption("--fmu-slow", action="store_true", help="also run tests marked fmu_slow")
    group.addoption(
        "--fmu-vendor",
        choices=("skip", "require"),
        default="skip",
        help="tests marked fmu_vendor('file') whose file is absent: skip them (default), or fail them",
    )
    parser.addini(
        "fmu_baseline_dir", "folder of all baselines, relative to the root; see --fmu-baseline-dir", default=""
    )
    parser.addini(
        "fmu_artifacts", "folder for pictures and pages of differences, relative to the root", default=".pytest_fmu"
    )


def mode(config: pytest.Config) -> Mode:
    """What to do with baselines.

    Args:
        config: of the session.
    """
    return cast(Mode, config.getoption("--fmu-baseline"))


def baseline_folder(config: pytest.Config, test_file: Path) -> Path:
    """Where the baselines of a test file are.

    Args:
        config: of the session. test_file: of the test.
    """
    stated = config.getoption("--fmu-baseline-dir") or config.getini("fmu_baseline_dir")
    if not stated:
        return test_file.parent / "baselines" / test_file.stem
    folder = config.rootpath / str(stated)
    inside = test_file.is_relative_to(config.rootpath)
    return folder / (test_file.relative_to(config.rootpath) if inside else Path(test_file.name)).with_suffix("")


def artifacts_folder(config: pytest.Config) -> Path:
    """Where pictures and pages go.

    Args:
        config: of the session.
    """
    return config.rootpath / str(config.getoption("--fmu-artifacts") or config.getini("fmu_artifacts"))


def shown(path: Path, config: pytest.Config) -> str:
    """A path as people see it: from the root, where it is inside.

    Args:
        path: of a file. config: of the session.
    """
    return str(path.relative_to(config.rootpath)) if path.is_relative_to(config.rootpath) else str(path)
