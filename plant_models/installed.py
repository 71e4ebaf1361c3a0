"""Versions of installed packages, without importing them."""

from __future__ import annotations

import re
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution

VERSION = re.compile(r"^Version: *(.+?) *$", re.MULTILINE)


@cache
def installed_version(package: str) -> str | None:
    """The version of an installed package; None where it is not installed.

    `importlib.metadata.version` parses the whole description of the package, as an e-mail, for this line.

    Args:
        package: its name.
    """
    try:
        known = distribution(package)
    except PackageNotFoundError:
        return None
    # a clone that is on the path has the latter, in its folder .egg-info
    found = VERSION.search(known.read_text("METADATA") or known.read_text("PKG-INFO") or "")
    return None if found is None else found[1]
