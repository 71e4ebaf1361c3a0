"""Draws the pictures of the guide from the scenarios that stand in its pages: ``python docs/guide_pictures.py [NAME]``.

A page's fenced TOML files are written to a folder and run there; so a picture is of the very scenario that the reader
sees. It takes a minute and touches ``docs/images/guide`` only.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import cosim.cli
import fmus
from cosim import Scenario
from cosim.drawing.style import BLUE, TIME, TRUE_LINE, VERMILION, ZONE, new_figure, styled
from plant_models import Locomotive

DOCS = Path(__file__).parent
PICTURES = DOCS / "images" / "guide"
FILE = re.compile(r"^```toml\n# (?P<name>[\w.]+)\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL)
sys.path.append(str(DOCS / "gallery"))

import shipped  # noqa: E402 - stands in a folder of scripts
import small_picture  # noqa: E402


def main(names: list[str]) -> None:
    """Draw all pictures, or those named."""
    for name, (page, draw) in DRAWN.items():
        if not names or name in names:
            with tempfile.TemporaryDirectory() as folder:
                unpack(DOCS / "guide" / f"{page}.md", Path(folder))
                os.chdir(folder)
                draw(PICTURES / f"{name}.png")
                os.chdir(DOCS)
            print(f"docs/images/guide/{name}.png")


def unpack(page: Path, folder: Path) -> None:
    """Write the scenario files of a page, and the FMU that they take for granted."""
    for match in FILE.finditer(page.read_text(encoding="utf-8")):
        (folder / match["name"]).write_text(match["text"], encoding="utf-8")
    if "vendor.fmu" in page.read_text(encoding="utf-8"):
        fmus.build_fmu(Locomotive(), folder / "vendor.fmu", fmi_version=2)


def structure(path: Path) -> None:
    """What ``cosim show --picture`` draws of the first scenario."""
    path.parent.mkdir(parents=True, exist_ok=True)
    Scenario.load("freight_profile_d").structure().draw(path)
    small_picture.shrink(path)


@styled
def exact_and_stale(path: Path) -> None:
    """Speed error where a balise acts at its own instant, and at the next communication point."""
    changes = {
        "step": 0.05,
        "balises.spacing": 5.0,
        "observer.preset": "repaired",
        "odometer.noise_std": 0.0,
        "certificates": "ignore",
    }
    figure = new_figure((7.0, 2.6))
    axes = figure.subplots()
    for timing, colour, words in (
        ("stale", VERMILION, "used at the next communication point"),
        ("exact", BLUE, "used at its own instant"),
    ):
        run = shipped.run("line.toml", {**changes, "balises.timing": timing})
        axes.plot(run["time"], run["observer.speed"] - run["train.speed"], color=colour, linewidth=1.0, label=words)
    axes.set(xlabel=TIME, ylabel="Speed error [m/s]", xlim=(20.0, 40.0), ylim=(-2.5, 2.5))
    axes.legend(loc="upper right")
    small_picture.save_small(figure, path)


@styled
def jam(path: Path) -> None:
    """Speeds and position error while the wheel of the odometer spins and locks."""
    run = shipped.run("jam.toml")
    figure = new_figure((7.0, 4.0))
    above, below = figure.subplots(2, 1, sharex=True)
    above.plot(run["time"], run["train.speed"], label="train", **TRUE_LINE)
    above.plot(run["time"], run["odometer.reading"], color="black", linewidth=0.8, label="odometer")
    above.plot(run["time"], run["observer.speed"], color=BLUE, linewidth=1.2, label="observer")
    above.set(ylabel="Speed [m/s]")
    above.legend(loc="lower right")
    below.plot(run["time"], run["observer.position"] - run["train.position"], color=BLUE, linewidth=1.2)
    below.set(xlabel=TIME, ylabel="Position error [m]")
    for axes in (above, below):
        active = run["wheel.active"] != 0.0
        axes.fill_between(run["time"], 0.0, 1.0, where=active, transform=axes.get_xaxis_transform(), color=ZONE)
    small_picture.save_small(figure, path)


@styled
def spacings(path: Path) -> None:
    """The sweep of the page: how the position error depends on the distance between balises."""
    values = [20.0, 35.0, 50.0, 75.0, 100.0, 150.0, 200.0]
    result = Scenario.load("train.toml").vary({"balises.spacing": values}).run(keep=False)
    errors = [run.measures["observer.position_error_max"] for run in result.runs]
    figure = new_figure((7.0, 2.6))
    axes = figure.subplots()
    axes.plot(values, errors, "o-", color=BLUE, markersize=4)
    axes.set(xlabel="Distance between balises [m]", ylabel="Largest position error [m]", ylim=(0.0, None))
    small_picture.save_small(figure, path)


def page(path: Path) -> None:
    """The first screen of the page of the first run, as a browser shows it."""
    photograph(shipped.run("freight_profile_d").write("results")["report"], path)


def comparison(path: Path) -> None:
    """The first screen of the page that compares the first run with that of the printed gains."""
    changed = {"stop": 30.0, "takagi_sugeno_cdo.preset": "as_published"}
    for name, changes in (("first", {"stop": 30.0}), ("published", changed)):
        shipped.run("freight_profile_d", changes).write(f"results/{name}", report=False)
    cosim.cli.main(["compare", "results/first", "results/published", "--html", "comparison.html", "--quiet"])
    photograph(Path("comparison.html"), path)


def photograph(html: Path, path: Path) -> None:
    """Save the first screen of a page.

    Raises:
        RuntimeError: there is no Chromium.
    """
    browser = os.environ.get("CHROMIUM") or shutil.which("chromium")
    if browser is None:
        raise RuntimeError("install Chromium, or name a browser by $CHROMIUM")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--virtual-time-budget=8000"]
    size, target = "--window-size=1000,900", f"--screenshot={path}"
    subprocess.run([browser, *options, size, target, html.resolve().as_uri()], check=True, capture_output=True)
    small_picture.shrink(path)


DRAWN: dict[str, tuple[str, Callable[[Path], None]]] = {
    "structure": ("first_run", structure),
    "page": ("first_run", page),
    "comparison": ("first_run", comparison),
    "exact_and_stale": ("scenarios", exact_and_stale),
    "jam": ("scenarios", jam),
    "spacings": ("studies", spacings),
}
"""By the name of the picture: the page whose scenarios it is of, and what draws it."""

if __name__ == "__main__":
    main(sys.argv[1:])
