"""Templates: what they insert is escaped in pages and not in other files; a name that nobody gave is an error."""

from __future__ import annotations

import pytest
from jinja2 import UndefinedError

from fmus.documentation import page  # noqa: F401 - brings the filters of the templates
from fmus.templates import environment

TEXT = "<b> & 'c'"


def test_pages_are_escaped_and_other_files_are_not() -> None:
    files = environment("fmus.documentation")
    assert "pieces" in files.filters  # of fmus.documentation.page
    assert "<th>&lt;b&gt; &amp; &#39;c&#39;</th>" in files.from_string(
        '{% from "parts.html.j2" import table %}{% call(row) table([text], []) %}{% endcall %}'
    ).render(text=TEXT)
    assert TEXT in files.get_template("staticLinking.txt.j2").render(name=TEXT, version="3", commands={})


def test_a_name_that_nobody_gave_is_an_error() -> None:
    with pytest.raises(UndefinedError, match="'commands' is undefined"):
        environment("fmus.documentation").get_template("staticLinking.txt.j2").render(name="x", version="3")
