"""Live pages in a browser, from a file: zoom, cursor, legend, search, jump, difference, sort, filter, click through."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import browser
import numpy as np
import pytest
from browser import DESKTOP, PHONE, check_page
from live_pages import SPIKE, TIME, explored_page, overlaid_page, written
from playwright.sync_api import Page

from cosim.report.live import page_data
from cosim.report.live.live_page import LivePage, PageCurve, PagePanel, PageRecording, PageVerdict
from cosim.results.shown_unit import ShownUnit

pytestmark = pytest.mark.browser
EXPLORER = "document.getElementById('explorer').explorer"


@contextmanager
def opened(page: LivePage, folder: Path, width: int = DESKTOP) -> Iterator[Page]:
    """The page from its file; no error may be on the console."""
    errors: list[str] = []
    with browser.open_page(written(page, folder / "page.html"), width=width) as shown:
        shown.emulate_media(reduced_motion="reduce")  # nothing moves while the mouse does
        shown.on("pageerror", lambda error: errors.append(error.message))
        shown.on("console", lambda said: errors.append(said.text) if said.type == "error" else None)
        yield shown
    assert errors == []


def shown_range(page: Page) -> list[float]:
    found: list[float] = page.evaluate(f"{EXPLORER}.range")
    return found


def values(page: Page) -> dict[str, str]:
    """What the legends say at the cursor, by the text of the curve."""
    found: dict[str, str] = page.evaluate(
        "Object.fromEntries([...document.querySelectorAll('.entry')].map((e) => "
        "[e.querySelector('.name').textContent, e.querySelector('.value').textContent]))"
    )
    return found


def plot(page: Page, number: int = 0) -> Any:
    place = page.locator(".u-over").nth(number).bounding_box()
    assert place is not None
    return place


@pytest.mark.parametrize("width", [DESKTOP, PHONE])
def test_pages_are_fit_for_screen_phone_and_paper(width: int, tmp_path: Path) -> None:
    check_page(written(explored_page(), tmp_path / "page.html"))
    with opened(explored_page(), tmp_path, width) as page:
        assert page.locator("canvas").count() == 2
        assert page.locator(".verdict").inner_text() == "It is good."


def test_what_is_decoded_is_what_was_packed(tmp_path: Path) -> None:
    odd = np.array([1.0, np.nan, np.inf, -np.inf, 1e300, -1e-300, 2.0, 3.0])
    columns = {"a.odd": odd, "a.line": np.linspace(-5.0, 5.0, 8), "a.big": 10.0 ** np.arange(8) ** 2}
    made = LivePage(
        "t",
        PageVerdict("v"),
        recordings=[PageRecording("r", np.arange(8.0), [PageCurve(n, v) for n, v in columns.items()])],
        panels=[PagePanel("p", list(columns))],
    )
    with opened(made, tmp_path) as page:
        for name, expected in columns.items():
            found = page.evaluate(f"Array.from({EXPLORER}.curvesOf('{name}')[0].y, String)")
            np.testing.assert_allclose([float(v.replace("Infinity", "inf")) for v in found], expected, rtol=1e-6)


def test_all_panels_zoom_together_and_every_row_is_drawn_then(tmp_path: Path) -> None:
    with opened(explored_page(), tmp_path) as page:
        place = plot(page)
        y = place["y"] + 40
        page.mouse.move(place["x"] + 0.6 * place["width"], y)
        page.mouse.down()
        page.mouse.move(place["x"] + 0.65 * place["width"], y, steps=4)
        page.mouse.up()
        low, high = shown_range(page)
        assert (low, high) == pytest.approx((60.0, 65.0), abs=0.3)
        ranges = page.evaluate(f"{EXPLORER}.charts.map((c) => [c.plot.scales.x.min, c.plot.scales.x.max])")
        assert ranges == [[low, high]] * 2
        rows = page.evaluate(f"{EXPLORER}.charts[0].plot.data[0].length")
        assert rows == pytest.approx(5.0 / (TIME[1] - TIME[0]), rel=0.1)
        page.mouse.dblclick(place["x"] + 100, y)
        assert shown_range(page) == [0.0, 100.0]


def test_extremes_are_drawn_at_every_zoom(tmp_path: Path) -> None:
    with opened(explored_page(), tmp_path) as page:
        largest = f"Math.max(...{EXPLORER}.charts[0].plot.data[1].filter(Number.isFinite))"
        assert page.evaluate(largest) == pytest.approx(7.0, abs=1e-4)
        for _ in range(6):
            page.evaluate(f"{EXPLORER}.scale(0.5, {TIME[SPIKE]})")
            assert page.evaluate(largest) == pytest.approx(7.0, abs=1e-4)


def test_cursor_and_keys_show_values_with_units(tmp_path: Path) -> None:
    with opened(explored_page(), tmp_path) as page:
        place = plot(page, 1)
        page.mouse.move(place["x"] + place["width"] / 2, place["y"] + 30)
        found = values(page)
        assert found["train.position"].endswith(" m")
        assert float(found["train.position"].split()[0]) == pytest.approx(50.0, abs=0.2)
        assert float(found["train.speed"].split()[0].replace("−", "-")) == pytest.approx(np.sin(50.0 / 3.0), abs=0.05)
        page.locator(".plot").first.focus()
        for key in ("+", "+", "Shift+ArrowRight", "ArrowRight"):
            page.keyboard.press(key)
        low, high = shown_range(page)
        assert high - low == pytest.approx(25.0)
        page.keyboard.press("Home")
        assert shown_range(page) == [0.0, 100.0]
        page.keyboard.press("n")
        page.get_by_role("status").filter(has_text="spike").wait_for()


def test_curves_are_hidden_and_signals_found_and_added(tmp_path: Path) -> None:
    with opened(explored_page(), tmp_path) as page:
        entry = page.locator(".entry", has_text="observer.speed")
        entry.click()
        assert page.locator(".entry", has_text="observer.speed").get_attribute("aria-pressed") == "false"
        assert page.evaluate(f"{EXPLORER}.charts[0].plot.series.length") == 2  # time and one curve
        page.get_by_label("Search signals").fill("level")
        assert page.locator(".signal:visible").count() == 1
        page.locator(".signal").click()
        page.wait_for_function(f"{EXPLORER}.charts.length === 3")
        assert page.locator("figcaption b").all_inner_texts() == ["Speed", "Way", "Signals [1]"]
        page.get_by_label("Search signals").fill("fast")  # of its description
        assert page.locator(".signal:visible").all_inner_texts()[0].startswith("speed")


def test_a_mark_is_jumped_to_with_the_panel_that_it_is_about(tmp_path: Path) -> None:
    with opened(explored_page(), tmp_path) as page:
        page.get_by_role("button", name="The worst point").click()
        low, high = shown_range(page)
        assert low < TIME[SPIKE] < high
        assert high - low < 10.0
        page.get_by_label("Search marks").fill("wet")
        page.locator(".marks button").click()
        page.wait_for_function(f"{EXPLORER}.charts.length === 3 && {EXPLORER}.range[0] < 30")
        low, high = shown_range(page)
        assert low < 30.0
        assert high > 50.0
        assert page.locator("figcaption b").first.inner_text() == "Force"


def test_axes_are_chosen(tmp_path: Path) -> None:
    with opened(explored_page(), tmp_path) as page:
        page.get_by_role("combobox", name="Over").select_option(label="train.position")
        page.wait_for_function(f"{EXPLORER}.axisName() === 'train.position [m]'")
        page.get_by_role("button", name="Logarithmic axis, of absolute values: Speed").click()
        page.wait_for_function(f"{EXPLORER}.charts[0].plot.scales['y m/s'].distr === 3")
        assert page.evaluate(f"Math.min(...{EXPLORER}.charts[0].plot.data[1].filter(Number.isFinite))") > 0.0


def test_the_difference_of_two_runs(tmp_path: Path) -> None:
    """The second is twice the first, has every other row, and ends earlier; of a name with two units there is none."""
    with opened(overlaid_page(), tmp_path) as page:
        assert page.locator(".entry", has_text="train.position").count() == 2
        assert page.evaluate(f"Object.keys({EXPLORER}.charts[1].limits)") == ["N", "kN"]
        page.get_by_role("combobox", name="Show").select_option(label="difference to first")
        page.wait_for_function("document.querySelectorAll('.entry').length === 1")
        assert page.locator(".entry .name").inner_text() == "train.position: second − first"
        place = plot(page)
        page.mouse.move(place["x"] + 0.4 * place["width"], place["y"] + 30)
        found = values(page)["train.position: second − first"]
        assert float(found.split()[0]) == pytest.approx(40.0, abs=0.2)


def subtract(page: Page, first: str, second: str) -> str:
    """Ask for the difference of two signals; what is wrong with it."""
    page.locator("details", has_text="Difference of two signals").last.evaluate("(node) => { node.open = true; }")
    page.get_by_label("first signal", exact=True).fill(first)
    page.get_by_label("minus second signal").fill(second)
    form = page.locator("form.difference")
    form.evaluate("(node) => { node.querySelector('[role=status]').textContent = '...'; }")
    form.get_by_role("button", name="draw").click()
    page.wait_for_function("document.querySelector('form.difference [role=status]').textContent !== '...'")
    return form.get_by_role("status").inner_text()


@pytest.mark.parametrize("room", [page_data.ROOM, 1])
def test_the_difference_of_two_signals_of_a_run(room: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One is .001 m/s larger than the other; also where a page has room for extremes alone."""
    monkeypatch.setattr(page_data, "ROOM", room)
    monkeypatch.setattr(page_data, "ROOM_A_ROW", 0)
    with opened(explored_page(), tmp_path) as page:
        assert subtract(page, "observer.speed", "train.speed") == ""
        name = "observer.speed − train.speed"
        assert page.locator("figcaption b").first.inner_text() == name
        curve = f"{EXPLORER}.curvesOf('{name}')[0]"
        np.testing.assert_allclose(page.evaluate(f"Array.from({curve}.y)"), 1e-3, atol=2e-6)
        assert page.evaluate(f"{curve}.whole") == (room > 1)
        assert page.evaluate(f"{EXPLORER}.charts[0].all[0].x.length === {curve}.y.length")
        assert page.evaluate(f"Object.keys({EXPLORER}.charts[0].limits)") == ["m/s"]
        place = plot(page)
        page.mouse.move(place["x"] + 0.4 * place["width"], place["y"] + 30)
        assert values(page)[name].endswith(" m/s")
        count = page.locator("figure.panel").count()
        assert subtract(page, "train.speed", "train.position") == (
            "train.speed is in m/s, train.position in m: a difference needs two signals of one unit."
        )
        assert subtract(page, "train.sped", "train.speed") == "No signal is named train.sped."
        assert subtract(page, "", "") == "Choose two signals."
        assert page.locator("figure.panel").count() == count


def test_the_difference_of_two_signals_is_drawn_for_every_run(tmp_path: Path) -> None:
    with opened(overlaid_page(), tmp_path) as page:
        assert subtract(page, "train.speed", "observer.speed") == ""
        assert page.locator("figure.panel").first.locator(".entry").count() == 2


def test_tables_are_sorted_filtered_chosen_and_lead_on(tmp_path: Path) -> None:
    (tmp_path / "other.html").write_text("<title>the run</title>", encoding="utf-8")
    with opened(explored_page(), tmp_path) as page:
        page.locator("details.section summary").first.click()
        rows = page.locator(".explored tbody tr:visible th")
        page.get_by_role("button", name="error [m/s]").click()
        assert rows.first.inner_text() == "run 11"
        page.get_by_role("button", name="error [m/s]").click()
        assert rows.first.inner_text() == "run 0"
        page.get_by_label("Filter rows").fill("gain < 3")
        assert page.locator(".explored output").inner_text() == "3 of 12 rows"
        assert rows.count() == 3
        page.get_by_label("Filter rows").fill("")
        assert page.locator(".strip").count() == 2  # a sentence that begins with a number is none
        page.locator(".strip").nth(1).scroll_into_view_if_needed()
        strip = page.locator(".strip").nth(1).bounding_box()  # the error, of which the upper half is chosen
        assert strip is not None
        page.mouse.move(strip["x"] + 10, strip["y"] + 4)
        page.mouse.down()
        page.mouse.move(strip["x"] + 10, strip["y"] + strip["height"] / 2)
        page.mouse.up()
        assert page.locator(".explored output").inner_text() == "6 of 12 rows"
        assert page.locator(".run.out").count() == 6
        page.get_by_role("link", name="run 0").click()
        page.wait_for_url("**/other.html")


def test_the_truth_is_seen_whole_also_before_estimates_are_evaluated(tmp_path: Path) -> None:
    """A train that departs begins at standstill; an estimate that has not settled sets no scale."""
    time = np.linspace(0.0, 60.0, 601)
    speed, estimate = np.minimum(time, 20.0), np.where(time < 5.0, -300.0, np.minimum(time, 20.0) + 0.1)
    known = [PageCurve("train.speed", speed, "m/s", look="true"), PageCurve("observer.speed", estimate, "m/s")]
    panels = [PagePanel("Speed", ["train.speed", "observer.speed"])]
    made = LivePage("t", PageVerdict("v"), recordings=[PageRecording("r", time, known)], panels=panels, settled=5.0)
    with opened(made, tmp_path) as page:
        low, high = page.evaluate(f"{EXPLORER}.charts[0].limits['m/s']")
    assert -3.0 < low < 0.0
    assert 20.0 < high < 23.0


def test_long_runs_open_with_their_extremes_and_are_whole_soon(tmp_path: Path) -> None:
    time = np.arange(250_000) * 0.01
    wave = np.sin(time / 50.0)
    wave[123_456] = 9.0
    made = LivePage(
        "t",
        PageVerdict("v"),
        recordings=[PageRecording("r", time, [PageCurve("a.b", wave)])],
        panels=[PagePanel("p", ["a.b"])],
    )
    with opened(made, tmp_path) as page:
        page.wait_for_function("document.getElementById('explorer').dataset.refined")
        assert page.evaluate(f"{EXPLORER}.curves[0].y.length") == len(time)
        page.evaluate(f"{EXPLORER}.zoom(1234.5, 1234.6)")
        found = [v for v in page.evaluate(f"{EXPLORER}.charts[0].plot.data[1]") if v is not None]
        assert max(found) == pytest.approx(9.0, abs=1e-3)
        assert len(found) in (11, 12, 13)


def test_a_panel_without_a_number_and_names_without_a_blank_fit_everywhere(tmp_path: Path) -> None:
    """On a logarithmic axis, too; a name is never cut, and a large number on an axis is short."""
    long, nothing = f"component.{'signal_with_a_long_name_' * 4}", np.full(3, np.nan)
    curves = [
        PageCurve(long, nothing, "m"),
        PageCurve("a.b", np.array([1.0, -2.34567e-5, 3.0]), "m/s2", label="largest speed of a long train in the rain"),
    ]
    made = LivePage(
        "t",
        PageVerdict("v"),
        recordings=[PageRecording("r", np.array([1.0e6, 1.1e6, 1.2e6]), curves, "train.mass", "kg")],
        panels=[PagePanel(long, [long], log=True), PagePanel("b", ["a.b", long])],
    )
    check_page(written(made, tmp_path / "page.html"))
    with opened(made, tmp_path, PHONE) as page:
        cut = "[...document.querySelectorAll('.entry .name')].filter((e) => e.scrollWidth > e.clientWidth + 1).length"
        assert page.evaluate(cut) == 0
        assert page.evaluate(f"{EXPLORER}.axisName()") == "train.mass [kg]"
        before = plot(page, 1)
        page.evaluate(f"{EXPLORER}.point(1.1e6)")  # values in the legends do not move the plot away from the mouse
        assert plot(page, 1) == before
        assert page.evaluate("[1e6, 1.25e6, 1.23456789e-7, 12].map((v) => shown(v, 7))") == [
            "1e6",
            "1.25e6",
            "1.23457e−7",
            "12",
        ]


def test_a_browser_whose_system_has_no_language_draws(tmp_path: Path) -> None:
    """As WebKit's under LANG=C, which calls its language C."""
    with opened(explored_page(), tmp_path) as page:
        page.add_init_script("Object.defineProperty(navigator, 'language', {value: 'C', configurable: true})")
        page.reload()
        page.wait_for_selector("#explorer[data-ready]")
        assert page.locator("canvas").count() == 2


def test_dark_and_light_are_drawn(tmp_path: Path) -> None:
    with opened(explored_page(), tmp_path) as page:
        ink = f"{EXPLORER}.charts[0].all[0].style.stroke"
        light = page.evaluate(ink)
        page.emulate_media(color_scheme="dark")
        page.wait_for_function(f"{ink} !== '{light}'")
        page.emulate_media(color_scheme="dark", media="print")
        page.wait_for_function(f"{ink} === '{light}'")  # paper is white


def test_without_javascript_sentence_and_tables_are_there(tmp_path: Path) -> None:
    file = written(explored_page(), tmp_path / "page.html")
    context = browser._browser().new_context(java_script_enabled=False, offline=True)
    try:
        page = context.new_page()
        page.goto(file.as_uri())
        assert "need JavaScript" in page.locator("#explorer").inner_text()
        assert page.locator("tbody tr").count() == 12
    finally:
        context.close()


def test_an_axis_is_in_the_unit_of_all_its_curves_or_in_the_one_of_si(tmp_path: Path) -> None:
    fast, si = ShownUnit("km/h", 1.0 / 3.6, 0.0, "m/s"), ShownUnit("km", 1e3, 0.0, "m")
    curves = [
        PageCurve("plant.vIst", np.full(len(TIME), 10.0), "m/s", shown=fast),
        PageCurve("plant.vSoll", np.full(len(TIME), 20.0), "m/s", shown=fast),
        PageCurve("observer.speed", np.full(len(TIME), 15.0), "m/s"),
        PageCurve("plant.way", 10.0 * TIME, "m", shown=si),
    ]
    panels = [
        PagePanel("Own", ["plant.vIst", "plant.vSoll"]),
        PagePanel("Mixed", ["plant.vIst", "observer.speed", "plant.way"]),
    ]
    page = LivePage(
        title="Units", verdict=PageVerdict("Two."), recordings=[PageRecording("run", TIME, curves)], panels=panels
    )
    with opened(page, tmp_path) as shown:
        shown.evaluate(f"{EXPLORER}.point(50.0)")
        entries = shown.locator(".entry").all_inner_texts()
        said = [" ".join(text.split()) for text in entries]
        assert said[:2] == ["plant.vIst 36 km/h", "plant.vSoll 72 km/h"]
        assert said[2:] == ["plant.vIst 10 m/s", "observer.speed 15 m/s", "plant.way 0.5 km"]
        units = shown.evaluate("[...document.querySelectorAll('.signal .unit')].map((e) => e.textContent)")
        assert units == ["km/h", "km/h", "km", "m/s"]
        assert shown.evaluate(f"{EXPLORER}.subtract('plant.vSoll', 'plant.vIst')") == ""
        shown.evaluate(f"{EXPLORER}.point(50.0)")
        assert shown.locator(".entry .value").first.inner_text() == "36 km/h"
        assert shown.evaluate(f"{EXPLORER}.subtract('plant.vSoll', 'observer.speed')") == ""
        shown.evaluate(f"{EXPLORER}.point(50.0)")
        assert shown.locator(".entry .value").first.inner_text() == "5 m/s"
        shown.get_by_label("Over").select_option(label="plant.way")
        shown.wait_for_function(f"{EXPLORER}.range[1] === 1")
        assert shown.evaluate(f"{EXPLORER}.axisName()") == "plant.way [km]"
