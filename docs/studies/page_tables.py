"""Where the studies put their tables: the part of a page between ``<!-- study: name -->`` and ``<!-- end -->``."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from pathlib import Path


def print_tables(page: Path, tables: Mapping[str, str]) -> None:
    """Print tables, and with ``--write`` on the command line put them into their parts of a page, a blank line around
    each.

    Args:
        page: file. tables: by name of the part.

    Raises:
        SystemExit: as of `write_table`.
    """
    for name, text in tables.items():
        print(text, end="\n\n")
        if "--write" in sys.argv:
            write_table(page, name, f"\n{text}\n")


def write_table(page: Path, name: str, text: str) -> None:
    """Put a table into its part of a page.

    Args:
        page: file. name: of the part. text: the table, with the blank lines that the page has around it.

    Raises:
        SystemExit: the page has not exactly one part of that name.
    """
    part = rf"(<!-- study: {name} -->\n).*?(<!-- end -->)"
    found = page.read_text(encoding="utf-8")
    written, count = re.subn(part, lambda m: f"{m[1]}{text}\n{m[2]}", found, flags=re.DOTALL)
    if count != 1:
        sys.exit(f"{page.name} has {count} parts '<!-- study: {name} -->' ... '<!-- end -->'")
    page.write_text(written, encoding="utf-8", newline="\n")
