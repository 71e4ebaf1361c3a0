"""Scenario files from their templates. Texts of vendors cannot leave their line."""

from __future__ import annotations

from typing import Any

from cosim.starter.toml_lines import comment, entry, guessed, inline, listing, one_line
from fmus.templates import environment


def render(kind: str, **values: Any) -> str:
    """A scenario file as text.

    Args:
        kind: ``train``, ``observer`` or ``alone``.
        values: what the template inserts, by name.

    Returns:
        The file.
    """
    files = environment("cosim.starter")
    filters: dict[str, Any] = {"comment": comment, "guessed": guessed, "one_line": one_line, "python": repr}
    files.filters |= filters | {"toml": inline}
    return files.get_template(f"{kind}.toml.j2").render(entry=entry, listing=listing, **values)
