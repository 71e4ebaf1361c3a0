"""Jinja2 templates, which lie in the folder `templates` beside the code that fills them: pages, which are escaped, and
other text, which is not.
"""

from __future__ import annotations

from functools import cache

from jinja2 import Environment, PackageLoader, StrictUndefined


@cache
def environment(package: str) -> Environment:
    """The templates of a package; filters may be added to it.

    Args:
        package: name of the package that holds the folder ``templates``.

    Returns:
        The same environment at every call. What a template inserts is escaped where its name ends in ``.html.j2``; a
        name that nobody gave is an error.
    """
    return Environment(
        loader=PackageLoader(package),
        autoescape=lambda name: name is not None and name.endswith(".html.j2"),
        extensions=["jinja2.ext.do"],
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
