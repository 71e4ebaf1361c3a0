"""The pytest plugin as a user meets it: ten lines beside a vendor's FMU, baselines, options, workers, what it costs."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import failing_models
import pytest
from plugin_sessions import MADE, ONE, run, write

import cosim.baselines.call
import cosim.comparison.comparison_text
import cosim.report.page.comparison
import fmus
import plant_models
from cosim.pytest_plugin.fixture import _baseline_name

pytest_plugins = ["pytester"]

SCENARIO = """
stop = 0.2
step = 0.01
[components.loco]
model = "locomotive"
as = "block3"
parameters = {train_speed = 10.0}
"""


@pytest.fixture(scope="module", autouse=True)
def _loaded(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Load what the fixture loads: pytester forgets what an inner session imported, and to import it again takes
    seconds.
    """
    path = tmp_path_factory.mktemp("loaded") / "run.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    call = cosim.baselines.call.Call.run("run.toml", path.parent, path.with_name("base.json"))
    cosim.report.page.comparison.write_comparison(call.update().after, path.parent / "drawn")


def tree(pytester: pytest.Pytester) -> dict[str, bytes]:
    folder = pytester.path / "baselines"
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


TEN_LINES = """
import pytest

@pytest.mark.parametrize("effort", [1e5])
def test_traction(fmu_regression, effort):
    found = fmu_regression("vendor.fmu", stop=1.0, step=0.01, inputs={"effort": effort}, parameters=PARAMETERS,
                           signals=["speed", "position"], tolerance=1e-4, tolerances={"speed": {"absolute": 1e-6}})
    assert found.outcome["fmu.speed"][-1] > 0.5
"""


@pytest.mark.compiler
def test_ten_lines_beside_a_vendor_fmu(pytester: pytest.Pytester) -> None:
    shutil.copy(fmus.cached_fmu(plant_models.Locomotive(), 3), pytester.path / "vendor.fmu")
    pytester.makepyfile(test_train=TEN_LINES.replace("PARAMETERS", "{}"))
    first = run(pytester)
    first.assert_outcomes(failed=1)
    first.stdout.fnmatch_lines(["*There is no baseline*pytest --fmu-baseline=update*"])
    run(pytester, "--fmu-baseline=update").assert_outcomes(passed=1)
    assert sorted(tree(pytester)) == [f"test_train/test_traction-100000.0.{kind}" for kind in ("csv", "json")]
    run(pytester).assert_outcomes(passed=1)
    header = json.loads(tree(pytester)["test_train/test_traction-100000.0.json"])
    assert header["run"] == {
        "kind": "fmu",
        "source": "../../vendor.fmu",
        "stop": 1.0,
        "step": 0.01,
        "inputs": {"effort": 1e5},
    }
    assert header["components"][0]["model"] == "locomotive"

    pytester.makepyfile(test_train=TEN_LINES.replace("PARAMETERS", "{'mass': 80.8e3}"))  # one per cent heavier
    changed = run(pytester)
    changed.assert_outcomes(failed=1)
    changed.stdout.fnmatch_lines(
        [
            "Parameter fmu.mass is 80800.0 instead of its default.",
            "result DIFFERS from test_traction-100000.0.json: 2 differ*",
            "*both signals scale by +11.3 %",
            "*fmu.speed*",
            "*worst points*",
            "*baseline: baselines*test_traction-100000.0.json",
            "*html: .pytest_fmu*comparison.html",
            "*png: .pytest_fmu*.png",
        ],
    )
    changed.stdout.no_fnmatch_line("*Traceback*")
    changed.stdout.no_fnmatch_line("*During handling*")
    assert len(list((pytester.path / ".pytest_fmu").rglob("*.png"))) == 2
    assert (pytester.path / ".pytest_fmu" / ".gitignore").read_text() == "*\n"


def test_update_check_and_unchanged_files(pytester: pytest.Pytester) -> None:
    write(pytester, ONE)
    updated = run(pytester, "--fmu-baseline=update")
    updated.assert_outcomes(passed=1)
    assert updated.ret == pytest.ExitCode.OK
    updated.stdout.fnmatch_lines(["*fmu baselines*", "1 checked: 1 new", "*test_line.json new", "1 written."])
    before = tree(pytester)
    again = run(pytester, "--fmu-baseline=update")
    again.stdout.fnmatch_lines(["1 checked: 1 unchanged"])
    again.stdout.no_fnmatch_line("[0-9]* written.")
    run(pytester).stdout.fnmatch_lines(["1 checked: 1 as before"])
    write(pytester, ONE, 1.1)
    changed = run(pytester, "--fmu-baseline=update")
    changed.assert_outcomes(passed=1)
    changed.stdout.fnmatch_lines(["1 checked: 1 changed", "*train.*at worst 0.1 m/s too high*", "1 written."])
    assert tree(pytester) != before
    run(pytester).assert_outcomes(passed=1)


def test_check_fails_with_the_worst_and_writes_no_baseline(pytester: pytest.Pytester) -> None:
    write(pytester, ONE)
    run(pytester, "--fmu-baseline=update")
    before = tree(pytester)
    write(pytester, ONE, 1.5)
    checked = run(pytester)
    checked.assert_outcomes(failed=1)
    checked.stdout.fnmatch_lines(
        ["*at worst 0.5 m/s too high at 1 s*", "*accept them with: pytest --fmu-baseline=update*"]
    )
    shown = run(pytester, "--fmu-baseline=diff")
    shown.assert_outcomes(passed=1)
    shown.stdout.fnmatch_lines(["1 checked: 1 differ", "*at worst 0.5 m/s too high*", "*png: .pytest_fmu*"])
    assert tree(pytester) == before
    write(pytester, ONE, 1.0)
    run(pytester).assert_outcomes(passed=1)
    assert not list((pytester.path / ".pytest_fmu").rglob("*.png"))  # the pictures of a difference go with it


def test_a_difference_is_reported_where_its_picture_fails(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object, **_options: object) -> None:
        raise ValueError("no font")

    write(pytester, ONE)
    run(pytester, "--fmu-baseline=update")
    write(pytester, ONE, 1.5)
    monkeypatch.setattr(cosim.report.page.comparison, "write_comparison", fails)
    checked = run(pytester)
    checked.assert_outcomes(failed=1)
    checked.stdout.fnmatch_lines(["*at worst 0.5 m/s too high at 1 s*", "*picture: could not be made: no font*"])


FAILING = """
import pytest
from cosim import Scenario

def scenario(begin):
    s = Scenario(stop=0.6, step=0.1).add("boiler", model="FILE:Worn", **{"as": "block3"})
    return s.set("boiler.from_when", begin)

def test_boiler(fmu_regression):
    fmu_regression(scenario(SLOPE))
"""


def test_what_a_component_raises_is_reported_in_its_own_words(pytester: pytest.Pytester) -> None:
    """With and without a baseline, when it is compared and when it is written."""
    text = FAILING.replace("FILE", failing_models.__file__)
    fails = f"*Component 'boiler' at t = 0.2 s: *{failing_models.WORDS}*"
    write(pytester, text, 0.29)
    for options in ([], ["--fmu-baseline=update"], ["--fmu-baseline=diff"]):
        reported = run(pytester, *options)
        reported.assert_outcomes(failed=1)
        reported.stdout.fnmatch_lines([fails])
    write(pytester, text, 99.0)
    run(pytester, "--fmu-baseline=update").assert_outcomes(passed=1)
    before = tree(pytester)
    write(pytester, text, 0.29)
    for options in ([], ["--fmu-baseline=update"]):
        reported = run(pytester, *options)
        reported.assert_outcomes(failed=1)
        reported.stdout.fnmatch_lines([fails])
        reported.stdout.no_fnmatch_line("*Traceback*")
    assert tree(pytester) == before


BESIDE = ONE + "def test_other():\n    assert SLOPE == 1.0\n"


@pytest.mark.parametrize("options", [[], ["-x"]])
def test_update_is_refused_while_a_test_fails(options: list[str], pytester: pytest.Pytester) -> None:
    write(pytester, BESIDE)
    run(pytester, "--fmu-baseline=update")
    before = tree(pytester)
    write(pytester, BESIDE, 2.0)
    refused = run(pytester, "--fmu-baseline=update", *options)
    refused.assert_outcomes(passed=1, failed=1)
    refused.stdout.fnmatch_lines(["No baseline was written: tests failed (1 to be written).*--fmu-baseline-force*"])
    assert tree(pytester) == before
    forced = run(pytester, "--fmu-baseline=update", "--fmu-baseline-force", *options)
    forced.stdout.fnmatch_lines(["1 written."])
    assert tree(pytester) != before


def test_update_is_refused_where_a_module_cannot_be_collected(pytester: pytest.Pytester) -> None:
    write(pytester, ONE)
    pytester.makepyfile(test_broken="import no_such_module_anywhere")
    run(pytester, "--fmu-baseline=update", "--continue-on-collection-errors").stdout.fnmatch_lines(
        ["No baseline was written*"]
    )
    assert not (pytester.path / "baselines").exists()


def test_workers_stage_and_the_controller_writes(pytester: pytest.Pytester) -> None:
    cases = "@pytest.mark.parametrize('k', range(4))\ndef test_line(fmu_regression, k):\n"
    cases += "    fmu_regression(line(1.0 + k))\n    assert k < SLOPE\n"
    write(pytester, MADE + cases, 3.0)
    options = ["-p", "no:cacheprovider", "--fmu-baseline=update", "-n"]
    refused = pytester.runpytest_subprocess(*options, "1")
    refused.assert_outcomes(passed=3, failed=1)
    refused.stdout.fnmatch_lines(["4 checked: 4 new", "No baseline was written: tests failed (4 to be written)*"])
    assert not (pytester.path / "baselines").exists()
    write(pytester, MADE + cases, 4.0)
    written = pytester.runpytest_subprocess(*options, "2")
    written.assert_outcomes(passed=4)
    written.stdout.fnmatch_lines(["4 checked: 4 new", "4 written."])
    assert len(tree(pytester)) == 8
    run(pytester).assert_outcomes(passed=4)


def test_several_calls_are_numbered_or_named(pytester: pytest.Pytester) -> None:
    calls = "class TestA:\n    def test_all(self, fmu_regression):\n"
    calls += "".join(
        f"        fmu_regression(line({k}.0){name})\n" for k, name in enumerate(["", "", ", name='dry'"], 1)
    )
    write(pytester, MADE + calls)
    run(pytester, "--fmu-baseline=update").assert_outcomes(passed=1)
    names = {f"test_train/TestA.test_all{call}.json" for call in ("", "@2", "@dry")}
    assert {name for name in tree(pytester) if name.endswith(".json")} == names
    run(pytester).assert_outcomes(passed=1)
    write(pytester, MADE + calls + "        fmu_regression(line(), name='dry')\n")
    twice = run(pytester)
    twice.assert_outcomes(failed=1)
    twice.stdout.fnmatch_lines(["*has a baseline named 'dry' already*"])


def test_folders_can_be_chosen_and_what_is_unused_is_reported(pytester: pytest.Pytester) -> None:
    pytester.makeini("[pytest]\nfmu_baseline_dir = kept\nfmu_artifacts = seen\n")
    write(pytester, ONE)
    run(pytester, "--fmu-baseline=update").assert_outcomes(passed=1)
    assert (pytester.path / "kept" / "test_train" / "test_line.json").is_file()
    write(pytester, ONE.replace("test_line", "test_renamed"))
    reported = run(pytester, "--fmu-baseline=update")
    reported.stdout.fnmatch_lines(["Not used by this run: kept*test_line.json"])
    write(pytester, ONE, 2.0)
    run(pytester).assert_outcomes(failed=1)
    assert list((pytester.path / "seen").rglob("*.html"))
    run(pytester, "--fmu-baseline-dir=elsewhere", "--fmu-artifacts=there", "--fmu-baseline=update").assert_outcomes(
        passed=1
    )
    assert (pytester.path / "elsewhere" / "test_train" / "test_line.json").is_file()


@pytest.mark.parametrize(
    ("call", "says"),
    [
        ("fmu_regression('absent.fmu', stop=1.0)", "*absent.fmu does not exist*"),
        ("fmu_regression('absent.toml')", "*absent.toml does not exist*"),
        ("fmu_regression(line(), stop=1.0)", "*a result of a run made already takes no stop*"),
        ("fmu_regression(line(), tolerance=-1.0)", "*relative = -1.0: expected a number that is zero or positive*"),
        ("fmu_regression(line(), signals=['train.sped'])", "*train.speed*"),
        ("fmu_regression(3)", "*Expected the path of an FMU*got int*"),
    ],
)
def test_mistakes_are_reported_in_words(call: str, says: str, pytester: pytest.Pytester) -> None:
    write(pytester, MADE + f"def test_line(fmu_regression):\n    {call}\n")
    reported = run(pytester, "--fmu-baseline=update")
    reported.assert_outcomes(failed=1)
    reported.stdout.fnmatch_lines([says])
    reported.stdout.no_fnmatch_line("*Error: *")


def test_scenarios_by_file_and_tolerances_of_the_test_count(pytester: pytest.Pytester) -> None:
    (pytester.path / "run.toml").write_text(SCENARIO, encoding="utf-8")
    text = "def test_run(fmu_regression):\n"
    text += "    assert fmu_regression('run.toml', overrides={'loco.mass': MASS}, signals=['loco.sp*']EXTRA).actual\n"
    write(pytester, text.replace("MASS", "80e3").replace("EXTRA", ""))
    run(pytester, "--fmu-baseline=update").assert_outcomes(passed=1)
    header = json.loads(tree(pytester)["test_train/test_run.json"])
    assert header["run"] == {"kind": "scenario", "source": "../../run.toml", "overrides": {"loco.mass": 80e3}}
    write(pytester, text.replace("MASS", "81e3").replace("EXTRA", ""))
    run(pytester).assert_outcomes(failed=1)
    write(pytester, text.replace("MASS", "81e3").replace("EXTRA", ", tolerance=1.0"))
    run(pytester).assert_outcomes(passed=1)


MARKED = """
import pytest

@pytest.mark.fmu_slow
def test_slow():
    pass

@pytest.mark.fmu_vendor("delivery.fmu")
def test_vendor():
    pass
"""


def test_markers_for_slow_and_vendor_tests(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(MARKED)
    skipped = run(pytester, "-rs", "--strict-markers")
    skipped.assert_outcomes(skipped=2)
    skipped.stdout.fnmatch_lines(["*slow; run it with --fmu-slow*", "*the vendor file delivery.fmu is absent*"])
    run(pytester, "--fmu-slow").assert_outcomes(passed=1, skipped=1)
    required = run(pytester, "--fmu-vendor=require")
    assert (required.ret, required.parseoutcomes().get("skipped")) == (1, 1)
    required.stdout.fnmatch_lines(["*the vendor file delivery.fmu is absent (--fmu-vendor=require)*"])
    (pytester.path / "delivery.fmu").write_bytes(b"")
    run(pytester, "--fmu-slow", "--fmu-vendor=require").assert_outcomes(passed=2)


def test_names_are_safe_and_never_shared() -> None:
    assert _baseline_name("test_brakes[wet]") == "test_brakes-wet"
    assert _baseline_name("TestDrive::test_start", "2") == "TestDrive.test_start@2"
    odd = [
        "test_a[x/y]",
        "test_a[x:y]",
        "test_a[x y]",
        "test_a[../../etc]",
        "test_a[a@2]",
        "test_a[" + 300 * "z" + "]",
        "test_a[" + 301 * "z" + "]",
    ]
    names = [_baseline_name(node) for node in odd]
    assert len(set(names)) == len(odd)
    assert all(len(name) < 140 and not set(name) & set('/\\:*?"<>| @') for name in names)


HEAVY = ("numpy", "pydantic", "fmpy", "scipy", "matplotlib", "cosim.results.result")
START = f"import sys, cosim.pytest_plugin; print([m for m in {HEAVY} if m in sys.modules])"


def test_pytest_starts_without_what_runs_and_compares(tmp_path: Path) -> None:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(
        [sys.executable, "-c", START], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


FILTER = """
class BiasFilter:
    inputs = {"odometer": "m/s"}
    outputs = {"speed": "m/s"}

    def __init__(self, gain=0.5):
        self.gain, self.speed = gain, 0.0

    def step(self, t, inputs, dt):
        self.speed += self.gain * (inputs.odometer - self.speed)
"""
BASELINE_OF_FILTER = """
from bias_filter import BiasFilter
import cosim
import pytest

@pytest.mark.parametrize("observer", [BiasFilter, BiasFilter(gain=0.4), "bias_filter.py:BiasFilter"])
def test_filter(fmu_regression, observer):
    s = cosim.Scenario(folder=FOLDER, stop=0.2, step=0.01)
    s.add("loco", model="locomotive", parameters={"train_speed": 10.0}, **{"as": "block3"})
    s.add("observer", observer=observer)
    s.connect("loco.speed -> observer.odometer")
    fmu_regression(s)

def test_file(fmu_regression):
    fmu_regression("run.toml")
"""
OBSERVED = """
connections = ["loco.speed -> observer.odometer"]
[components.observer]
observer = "bias_filter.py:BiasFilter"
"""


def test_a_component_of_plain_python_has_a_baseline(pytester: pytest.Pytester) -> None:
    pytester.syspathinsert()
    file = pytester.path / "bias_filter.py"
    file.write_text(FILTER)
    head, _, components = SCENARIO.partition("[components")
    lines = OBSERVED.strip().splitlines()
    (pytester.path / "run.toml").write_text(
        "\n".join([head, lines[0], f"[components{components}", *lines[1:], ""]), encoding="utf-8"
    )
    pytester.makepyfile(test_filter=BASELINE_OF_FILTER.replace("FOLDER", repr(str(pytester.path))))
    run(pytester, "--fmu-baseline=update").assert_outcomes(passed=4)
    run(pytester).assert_outcomes(passed=4)
    file.write_text(FILTER.replace("self.gain *", "1.01 * self.gain *"))
    found = run(pytester)
    found.assert_outcomes(failed=4)
    found.stdout.fnmatch_lines(["*observer.speed*"])
