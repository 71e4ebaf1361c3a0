"""Documentation inside an FMU: a well-formed page that says everything the system and its description say, and the
licences.
"""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable
from math import isinf
from pathlib import Path
from typing import Any

import pytest
from fmpy import read_model_description
from lxml import etree, html

from fmu_observer import OBSERVERS
from fmu_observer.certificates.gap_findings import CONSTANT_GAP
from fmus import RECIPES, cached_fmu, recipe
from fmus.documentation.licences import licence_files, licence_texts
from fmus.documentation.page import page
from fmus.documentation.prose import blocks, pieces
from fmus.toolchain.platforms import host_platform
from fmus.toolchain.targets import Target, choose_targets
from plant_models.hybrid import HybridSystem, PeriodicEvent, input_signal, output_signal, parameter, state

pytestmark = pytest.mark.compiler


def documentation(system: HybridSystem, version: int) -> dict[str, str]:
    with zipfile.ZipFile(cached_fmu(system, version)) as archive:  # type: ignore[arg-type]
        return {
            name.removeprefix("documentation/"): archive.read(name).decode()
            for name in archive.namelist()
            if name.startswith("documentation/")
        }


def text_of(source: str) -> str:
    return " ".join(html.document_fromstring(source).text_content().split())


@pytest.mark.parametrize("name", RECIPES)
def test_the_page_is_well_formed_and_complete(name: str, version: int) -> None:
    system = recipe(name)
    source = documentation(system, version)["index.html"]
    etree.fromstring(source.removeprefix("<!DOCTYPE html>\n"))  # strictly: every element closed, every sign escaped
    assert source.startswith("<!DOCTYPE html>")
    assert 'name="viewport"' in source
    assert re.findall(r"https?:|<script|<link|<img|src=|@import|url\(", source) == []
    text = text_of(source)
    description = read_model_description(str(cached_fmu(system, version)))  # type: ignore[arg-type]
    for variable in description.modelVariables:
        if variable.causality in {"input", "output", "parameter"}:
            assert variable.name in text
            assert " ".join((variable.description or "").replace("`", "").split()) in text.replace("’", "'")
    for words in (
        system.description,
        system.source,
        f"FMI {version}.0",
        system.method,
        host_platform().name,
        *system.presets,
    ):
        assert " ".join(words.split()) in text
    assert str(type(system).__doc__).split()[0] in text


def test_starts_and_presets_are_those_of_the_model() -> None:
    system = recipe("locomotive")
    tables = html.document_fromstring(documentation(system, 2)["index.html"])
    rows = {row[0].text_content(): [cell.text_content() for cell in row[1:]] for row in tables.xpath("//tbody/tr")}
    names = list(system.presets)
    for parameter_name, value in system.preset_values(names[1]).items():
        # 12 digits are printed
        assert float(rows[parameter_name][1 + names.index(names[1])]) == pytest.approx(value, rel=1e-11)
    with_range = tables.xpath("//table[thead//th[4] = 'range']/tbody/tr")
    ranges = {row[0].text_content(): row[3].text_content() for row in with_range}
    for signal in (*system.inputs, *system.parameters):
        low, high = ("…" if bound is None else f"{bound:.12g}" for bound in (signal.min, signal.max))
        expected = f"{low} to {high}" if (low, high) != ("…", "…") else ""
        assert [ranges[name] for name in signal.scalar_names] == [expected] * len(signal.scalar_names)
    titles = [cell.text_content() for cell in tables.xpath("//th")]
    assert f"{system.default_preset} (this FMU)" in titles


@pytest.mark.parametrize("name", [name for name in OBSERVERS if hasattr(OBSERVERS[name], "sampled_events")])
def test_certificates_are_those_of_the_observer(name: str) -> None:
    system: Any = recipe(name)
    tables = html.document_fromstring(documentation(system, 3)["index.html"])
    rows = {row[0].text_content(): [cell.text_content() for cell in row[1:]] for row in tables.xpath("//tbody/tr")}
    titles = [cell.text_content() for cell in tables.xpath("//th")]
    for preset in list(system.presets) or [None]:
        certificate = next(system.findings(0.2, preset=preset))
        found = (certificate, certificate.condition(CONSTANT_GAP))
        ends = ["none" if isinf(part.value) else f"none up to {part.value:g} s" for part in found]
        limits = [end if isinf(part.limit) else f"{part.limit:.3g} s" for part, end in zip(found, ends, strict=True)]
        assert rows[preset or "declared starts"][-2:] == limits
        assert certificate.source in tables.text_content()
        row = rows[preset or "declared starts"]
        between = f"mixed {row[-3]} gaps" if len(row) > 2 else next(t for t in titles if t.startswith("mixed "))
        assert between.removesuffix(" certified up to") == certificate.what


def test_events_are_notified_as_the_version_of_fmi_does() -> None:
    counted, clocked = (
        text_of(documentation(recipe("takagi_sugeno_cdo"), version)["index.html"]) for version in (2, 3)
    )
    assert "raise balise_count by one" in counted
    assert "triggered input clock balise" not in counted
    assert "The triggered input clock balise: enter event mode, set the clock and balise_position, " in clocked
    assert "balise_location_accuracy, balise_time" in clocked
    assert "balise_count" not in clocked
    assert "every sample_period" in text_of(documentation(recipe("odometer"), 3)["index.html"])


class Odd(HybridSystem):
    """Signs that mean something in HTML: ``a < b & c = d``, <b>bold</b>.

    - first `one`
      goes on
    - second

    Args:
        kind: what it is & does
            on two lines.

    Raises:
        ValueError: never told to the user of an FMU.
    """

    name = "odd"
    description = 'A <model> & "more"'
    source = "K&R, <1978>"
    states = (state("place", "m"),)
    inputs = (input_signal("push", "N", description="5 < 6 & `code`"),)
    outputs = (output_signal("out", "m"),)
    parameters = (parameter("period", "s", 0.1),)
    events = (PeriodicEvent("tick", "period", None, (input_signal("hiss", "1"),)),)

    def __init__(self) -> None:
        super().__init__(kind="<none>")

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"place": u.push}

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"place": x.place + u.hiss}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"out": x.place}

    def sampled_events(self, p: Any) -> tuple[str, ...]:
        return ("tick",)

    def findings(self, gap: float | None = None, parameters: Any = None, preset: str | None = None) -> Any:
        raise ArithmeticError("1 < 0")


def test_nothing_of_a_users_text_becomes_html(version: int) -> None:
    parts = documentation(Odd(), version)
    tree = etree.fromstring(parts["index.html"].removeprefix("<!DOCTYPE html>\n"))
    text = text_of(parts["index.html"])
    for words in (
        'A <model> & "more"',
        "a < b & c = d",
        "<b>bold</b>",
        "K&R, <1978>",
        "5 < 6 & code",
        "kind = <none>",
        "1 < 0",
    ):
        assert words in text
    assert "never told" not in text
    assert [" ".join(item.itertext()).split() for item in tree.iter("li")][:2] == [
        ["first", "one", "goes", "on"],
        ["second"],
    ]
    assert "Its noise is a function of seed" in text
    assert "its terms are its author's to state" in text


def test_a_docstring_becomes_paragraphs_lists_and_formulae() -> None:
    assert blocks("One ``x = 1`` two\nlines.\n\n1. a\n2. b\n   and more") == [
        ("p", ["One ``x = 1`` two lines."]),
        ("ol", ["a", "b and more"]),
    ]
    assert pieces("One ``x = 1`` two `y`") == [("One ", False), ("x = 1", True), (" two ", False), ("y", True)]
    assert blocks("Args:\n    gain: of it.\n\nRaises:\n    ValueError: never.") == [("options", ["gain: of it."])]
    assert blocks("") == []


def test_a_formula_is_distinguished_from_other_code() -> None:
    tree = html.document_fromstring(documentation(recipe("locomotive"), 2)["index.html"])
    formulae = {code.text_content() for code in tree.xpath("//code[@class='formula']")}
    others = {code.text_content() for code in tree.xpath("//code[not(@class)]")}
    assert "gradient_shape = constant" in others
    assert formulae
    assert all(" = " in formula for formula in formulae)


@pytest.mark.foreign
def test_a_page_names_every_platform_and_compiler() -> None:
    system = recipe("odometer")
    description = read_model_description(str(cached_fmu(system)))
    (host,) = choose_targets()
    text = text_of(page(system, description, None, [host, Target(choose_targets("win64")[0].platform, host.compiler)]))
    assert "x86_64-windows" in text
    assert host.compiler.version in text
    assert "may differ in the last digits" in text


# -- licences -------------------------------------------------------------------------------------------------------


def test_licences(version: int) -> None:
    parts = documentation(recipe("odometer"), version)
    root = Path(__file__).parents[2]
    assert parts["licenses/fmu-observer.txt"] == (root / "LICENSE").read_text(encoding="utf-8")
    assert "Modelica Association" in parts["licenses/fmi-headers.txt"]
    assert "MIT-0" in parts["licenses/casadi-generated-code.txt"]
    assert [name for name in licence_texts() if name not in parts["licenses/license.txt"]] == []
    assert "part of fmu-observer: BSD-3-Clause" in parts["licenses/license.txt"]
    assert f"-DFMI{version}_FUNCTION_PREFIX=odometer_" in parts["staticLinking.txt"]


def test_the_licence_of_the_headers_is_theirs() -> None:
    from fmus.build import standard_headers

    own = " ".join(licence_texts()["fmi-headers.txt"].split())
    header = " ".join(standard_headers(3)["fmi3Functions.h"].decode().replace("-" * 76, "").split())
    assert own.partition("sources/. ")[2].strip() in header


def test_a_users_model_is_not_put_under_our_licence(reference: Callable[[str], Any]) -> None:
    assert "author's to state" in licence_files(reference("tracker").system)["licenses/license.txt"]
