"""The generated tables stand in the pages as ``docs/generate.py`` would write them now."""

from __future__ import annotations

import pytest
from pages import ROOT, generator

generate = generator()
QUICK = [key for key in generate.PARTS if key[1] != "printed table"]  # that one is compared as numbers in test_readme


@pytest.mark.parametrize(("file", "name"), QUICK)
def test_a_part_is_up_to_date(file: str, name: str) -> None:
    text = (ROOT / file).read_text(encoding="utf-8")
    assert generate.part(text, name) == generate.PARTS[file, name](), "run: python docs/generate.py"


def test_the_requirements_of_the_smallest_installation_are_up_to_date() -> None:
    text = generate.RUN_REQUIREMENTS.read_text(encoding="utf-8")
    assert text == generate.run_requirements(), "run: python docs/generate.py"


def test_every_table_of_the_schema_is_on_the_page() -> None:
    tables = set(generate.schema_tables().values())
    base = generate.schema.TomlTable
    modules = (generate.schema, generate.tables, generate.campaign_table)
    known = {c for module in modules for c in vars(module).values() if isinstance(c, type) and issubclass(c, base)}
    known -= {generate.schema.Expectation}  # these are in a registry, which the page is generated from
    assert {c for c in known if not c.__subclasses__()} == tables


def test_a_part_is_replaced_and_nothing_else() -> None:
    text = "before\n<!-- generated: a -->\nold\n<!-- end -->\nafter\n<!-- generated: b -->\nkept\n<!-- end -->\n"
    changed = generate.replace_part(text, "a", "new \\1\n")
    assert changed == text.replace("old", "new \\1")
    with pytest.raises(ValueError, match="generated: c"):
        generate.part(text, "c")
