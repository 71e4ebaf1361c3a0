"""`fmus check` against FMUs that lie in one way each: every lie is caught by name, and the honest one passes clean."""

from __future__ import annotations

from pathlib import Path

import pytest
from lying_fmus import SLAVE, STATES, build, description
from test_fmus.events import DEEDS, hostile_fmu

from fmus.check import CheckReport, Class, Verdict, check_fmu
from fmus.check.checked_instance import make_slave
from fmus.check.runner import Runner
from fmus.fmi.archive import open_archive
from fmus.isolation.crashes import noted_crash
from plant_models.disk_cache.files import file_digest

PASS, NOTE, LIMIT, DISTRUST, SKIPPED = Verdict.PASS, Verdict.NOTE, Verdict.LIMIT, Verdict.DISTRUST, Verdict.SKIPPED

pytestmark = pytest.mark.compiler


def checked(folder: Path, *lies: str, xml: str | None = None, timeout: float = 30.0) -> CheckReport:
    return check_fmu(build(folder, *lies, xml=xml), timeout=timeout)


def problems(report: CheckReport) -> dict[str, str]:
    """Detail by name of everything that neither passed nor was skipped."""
    return {f.check: f.detail for f in report.findings if f.verdict not in (PASS, SKIPPED)}


def test_the_honest_one_passes_clean(tmp_path: Path) -> None:
    report = checked(tmp_path, xml=description(SLAVE, STATES))
    assert problems(report) == {}
    assert report.clean
    assert {f.check for f in report.findings if f.verdict is SKIPPED} == set()
    text = " ".join(report.trust)
    promises = ("Variable step: yes", "Rollback: yes", "Reset: yes", "Several instances in one process: yes")
    assert [promise for promise in promises if promise not in text] == []


@pytest.mark.parametrize(
    ("lie", "check", "meaning", "words"),
    [
        ("UNSHORTENED", "divided steps", LIMIT, "the outputs differ: a step of 0.01 s and one in parts of 0.5 and 0.5"),
        ("OWN_STEP", "short step", LIMIT, "nothing moves in it"),
        ("HALF_RESTORED", "state round trip", LIMIT, "after a restored state the outputs differ"),
        ("SERIALISES_HALF", "serialised state", LIMIT, "after a state restored from bytes the outputs differ"),
        (
            "SERIALISES_HALF",
            "state in another instance",
            LIMIT,
            "after a state restored in another instance the outputs differ",
        ),
        ("RESET_KEEPS", "reset and re-run", LIMIT, "after a reset the outputs differ"),
        ("NAN_AT_START", "values at start", LIMIT, "not finite after initialisation: position = nan"),
        ("NAN_LATER", "stepping", DISTRUST, "not finite while stepping: position = nan, speed = nan"),
        (
            "NO_STATE_SYMBOLS",
            "exported symbols",
            LIMIT,
            "declares canGetAndSetFMUstate but does not export fmi2FreeFMUstate",
        ),
        ("NO_STATE_SYMBOLS", "state round trip", LIMIT, "does not export fmi2GetFMUstate"),
        (
            "LEAKS_FILES",
            "repeated instantiation",
            LIMIT,
            "leaks file descriptors: 40 more are open after 40 more instances",
        ),
        ("BOUNDS_INPUT", "values taken", LIMIT, "does not take what it is set: force was set to 1 and is 0.125"),
        ("NAN_MUCH_LATER", "long run", LIMIT, "not finite from t = 0.71 s on: speed = nan"),
        ("OPENS_FILES", "open files", LIMIT, "25 more files are open after 25 more steps"),
        ("WRITES_FILE", "written files", LIMIT, "it writes into the working directory: own.log"),
        ("MOVES", "surroundings", LIMIT, "it changed the working directory"),
        ("ROUNDS", "surroundings", LIMIT, "it changed the rounding of floating-point numbers"),
        ("TAKES_INTERRUPTS", "surroundings", LIMIT, "it changed the response to Ctrl-C"),
        ("HANDLES_SIGNALS", "surroundings", LIMIT, "it changed the response to SIGTERM"),
        ("LOWERS_LIMITS", "surroundings", LIMIT, "it changed the limits RLIMIT_NOFILE"),
        ("SETS_ENVIRONMENT", "surroundings", LIMIT, "it changed the environment variables LIAR_HOME"),
        ("FORGETS_ENVIRONMENT", "surroundings", LIMIT, "it changed the environment variables HOME"),
        ("CLOSES_OUTPUT", "surroundings", LIMIT, "it changed the standard streams"),
        ("CLOSES_INPUT", "surroundings", LIMIT, "it changed the standard streams"),
        ("CLOSES_ALL", "stepping", DISTRUST, "it closed files of the process that it had not opened"),
        ("MASKS", "surroundings", LIMIT, "it changed the permissions of new files"),
        ("LEAKS_QUIETLY", "memory of steps", LIMIT, "each step takes 100 MB more of memory, which it keeps"),
        ("THREAD", "between calls", LIMIT, "outputs change though nothing is called: speed"),
        (
            "FIRST_STEP_LOST",
            "first step",
            LIMIT,
            "the first step moves nothing, the second as much as the third: position",
        ),
        (
            "REFUSES_EARLY_READING",
            "reading at initialisation",
            DISTRUST,
            "outputs cannot be read in Initialization Mode",
        ),
        ("INPUT_LATE", "input at once", LIMIT, "acts in the one after it, on speed"),
        ("OTHER_START", "declared start values", LIMIT, "speed begins with 2, not with 1 as it is declared"),
        ("LEAKS_MEMORY", "repeated instantiation", LIMIT, "leaks memory"),
        ("SHARED", "two instances", LIMIT, "beside a second instance the outputs differ"),
        ("LOGGING_CHANGES", "logging", LIMIT, "with logging on the outputs differ"),
        ("LATE_EVENT", "events", DISTRUST, "event pulse inside a step does not happen at its stamp"),
        ("GETTER", "getters", LIMIT, "getReal of rate failed"),
        ("REFUSES_START", "initialise", DISTRUST, "fmi2ExitInitializationMode failed with status 3"),
        ("CRASH_AT_START", "initialise", DISTRUST, "crashed with signal 6 (SIGABRT) in 'initialise'"),
        ("CRASH_IN_STEP", "stepping", DISTRUST, "crashed with signal 11 (SIGSEGV) in 'stepping'"),
        ("EXITS", "stepping", DISTRUST, "ended the process with exit code 3 in 'stepping'"),
        ("CRASH_ON_ZERO", "zero step", LIMIT, "crashed with signal 6 (SIGABRT) in 'zero step'"),
        ("STATES_NOT_SET", "model exchange: states", DISTRUST, "not what is read back"),
        ("DERIVATIVES_DRIFT", "model exchange: states", DISTRUST, "the derivatives at the same states differ"),
        ("NAN_DERIVATIVE", "model exchange: values at start", DISTRUST, "derivatives [2] = nan"),
        (
            "DERIVATIVE",
            "model exchange: directional derivatives",
            LIMIT,
            "of rate along speed is said to be -0.505, differences give -0.5",
        ),
        ("NO_STATE_SYMBOLS", "model exchange: state round trip", LIMIT, "does not export fmi2GetFMUstate"),
        ("REFUSES_START", "model exchange: initialise", DISTRUST, "fmi2ExitInitializationMode failed"),
    ],
)
def test_a_lie_is_caught_by_name(lie: str, check: str, meaning: Verdict, words: str, tmp_path: Path) -> None:
    report = checked(tmp_path, lie, xml=description(None, STATES) if check.startswith("model exchange: ") else None)
    finding = report.finding(check)
    assert finding.verdict is meaning, finding
    assert words in finding.detail
    assert report.verdict is not Class.USE
    assert (report.verdict is Class.DISTRUST) or finding.advice


def test_another_locale_of_characters_is_told_and_limits_nothing(tmp_path: Path) -> None:
    """What Dymola's FMUs do, and what a run puts back: no number is written otherwise."""
    finding = checked(tmp_path, "LOCALISES").finding("surroundings")
    assert finding.verdict is NOTE, finding
    assert finding.detail == "it changed the locale of characters, which a run puts back"


@pytest.mark.parametrize(
    ("lie", "known"),
    [
        ("UNSHORTENED", {"divided steps", "short step"}),
        ("HALF_RESTORED", {"state round trip", "serialised state", "state in another instance"}),
        ("RESET_KEEPS", {"reset and re-run"}),
        ("LEAKS_FILES", {"repeated instantiation"}),
        ("LOGGING_CHANGES", {"logging"}),
        ("CRASH_ON_ZERO", {"zero step"}),
    ],
)
def test_a_lie_spoils_no_other_finding(lie: str, known: set[str], tmp_path: Path) -> None:
    assert set(problems(checked(tmp_path, lie))) == known


def test_a_hang_costs_its_time_limit_and_no_more(tmp_path: Path) -> None:
    report = checked(tmp_path, "HANG", timeout=2.0)
    assert report.finding("stepping").verdict is DISTRUST
    assert report.finding("stepping").detail == "no answer within 2 s in 'stepping'"
    assert report.finding("divided steps").detail == "not run, because 'stepping' failed"
    assert report.finding("getters").verdict is PASS
    assert report.trust == ("Nothing: it could not be stepped.",)


def test_a_crash_is_part_of_what_to_trust(tmp_path: Path) -> None:
    report = checked(tmp_path, "CRASH_ON_ZERO")
    assert "Run it in a process of its own: it died or hung in zero step." in report.trust
    assert "Rollback: yes" in " ".join(report.trust)


def test_prints_are_seen_and_do_not_disturb(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    report = checked(tmp_path, "PRINTS")
    assert set(problems(report)) == {"console output"}
    assert "beginning with: 'stepping to 0.01'" in report.finding("console output").detail
    assert capfd.readouterr() == ("", "")


def test_warnings_of_calls_are_counted(tmp_path: Path) -> None:
    report = checked(tmp_path, "WARNS")
    assert set(problems(report)) == {"warnings"}
    detail = "calls returned the status warning in a run of 25 steps: fmi2DoStep 14 times, first at t = 0.11 s"
    assert report.finding("warnings").detail == detail


def test_a_stated_start_of_what_moves_is_no_value_that_is_not_taken(tmp_path: Path) -> None:
    speed = 'name="speed" valueReference="3" causality='
    xml = description().replace(f'{speed}"output"', f'{speed}"local"')
    xml = xml.replace('<Unknown index="3"/></Outputs>', "</Outputs>")
    report = check_fmu(build(tmp_path, xml=xml), starts={"speed": 2.0, "force": 0.5})
    assert report.finding("values taken").verdict is PASS


def test_a_run_that_is_not_excited_keeps_the_start_values_of_inputs(tmp_path: Path) -> None:
    """As without them the steps would send zero."""
    archive = open_archive(build(tmp_path, "BOUNDS_INPUT"))
    with (
        archive.unpacked() as folder,
        Runner(lambda: make_slave(folder, archive.description), {"force": 0.1}, 0.0, 0.1) as runner,
    ):
        runner.begin(excited=False)
        runner.steps_at_most(1)
        assert runner.inputs == {"force": 0.1}
        assert runner.component.read(["force"]) == 0.1


def test_a_parameter_that_is_bounded_is_named(tmp_path: Path) -> None:
    fmu = hostile_fmu(tmp_path)
    bounds = {"deed": float(DEEDS.index("bounds"))}
    report = check_fmu(fmu, starts=bounds)
    assert report.finding("values taken").detail == "does not take what it is set: at was set to 0.5 and is 0.3"
    assert check_fmu(fmu).finding("values taken").verdict is PASS


@pytest.mark.parametrize(
    ("lie", "words"),
    [
        ("CRASH_FREED", "crashed with signal 11 (SIGSEGV) in freeInstance"),
        ("HANG_TERMINATED", "no answer within 3 s in terminate"),
    ],
)
def test_the_end_is_named_and_all_else_is_checked(lie: str, words: str, tmp_path: Path) -> None:
    report = checked(tmp_path, lie, timeout=3.0)
    assert problems(report) == {"terminate and free": words}
    assert (report.verdict, report.finding("terminate and free").verdict) == (Class.LIMITS, LIMIT)
    assert "Run it in a process of its own: it died or hung in terminate and free." in report.trust
    assert report.finding("state in another instance").verdict is PASS


@pytest.mark.parametrize(
    ("lie", "known"), [("CRASH_IN_STEP", "(SIGSEGV) in the check 'stepping'"), ("HANG_TERMINATED", "")]
)
def test_a_file_that_crashed_is_remembered_by_its_content(
    lie: str, known: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FMU_OBSERVER_CACHE", str(tmp_path / "cache"))
    report = checked(tmp_path, lie, timeout=3.0)
    said = noted_crash(file_digest(report.archive.path))
    assert known in said
    assert bool(said) == bool(known)  # one that was silent may be slow


def test_an_end_where_no_second_instance_is_allowed_is_named_too(tmp_path: Path) -> None:
    once = description(SLAVE | {"canBeInstantiatedOnlyOncePerProcess": "true"})
    report = checked(tmp_path, "CRASH_FREED", xml=once)
    assert report.finding("initialise").detail == "crashed with signal 11 (SIGSEGV) in freeInstance in 'initialise'"


def test_an_error_of_terminate_is_noted(tmp_path: Path) -> None:
    report = checked(tmp_path, "REFUSES_END")
    assert problems(report) == {"terminate and free": "terminate failed: fmi2Terminate failed with status 3 (error)"}
    assert report.verdict is Class.USE


def test_no_step_goes_a_rounding_beyond_the_announced_end(tmp_path: Path) -> None:
    """0.01 s added up 100 times is 1.0000000000000007 s; a run counts its steps, and its last one ends at 1 s."""
    xml = description().replace('stopTime="10"', 'stopTime="1"')
    assert problems(checked(tmp_path, "STRICT_END", xml=xml)) == {}


def test_what_an_instance_keeps_and_no_study_feels_is_noted(tmp_path: Path) -> None:
    report = checked(tmp_path, "LEAKS_LITTLE")
    assert set(problems(report)) == {"repeated instantiation"}
    assert report.verdict is Class.USE


def test_steps_that_must_be_refused(tmp_path: Path) -> None:
    report = checked(tmp_path, "ACCEPTS_ANYTHING")
    assert set(problems(report)) == {"negative step"}
    assert "accepts a step of -0.01 s instead of refusing it" in report.finding("negative step").detail


def test_the_environment_of_an_instance_may_be_read(tmp_path: Path) -> None:
    assert problems(checked(tmp_path, "READS_ENVIRONMENT")) == {}


def test_what_is_not_declared_is_not_tried(tmp_path: Path) -> None:
    report = checked(tmp_path, "UNSHORTENED", "NO_STATE_SYMBOLS", xml=description({}))
    reasons = {f.check: f.detail for f in report.findings if f.verdict is SKIPPED}
    assert reasons["divided steps"] == "does not declare canHandleVariableCommunicationStepSize"
    assert reasons["state round trip"] == "does not declare canGetAndSetFMUstate"
    assert reasons["directional derivatives"] == "does not declare providesDirectionalDerivative"
    assert set(problems(report)) == {"exported symbols"}
    assert report.finding("exported symbols").verdict is NOTE  # the standard wants them, but nothing was promised


def test_one_instance_in_a_process(tmp_path: Path) -> None:
    report = checked(tmp_path, "LEAKS_FILES", xml=description(SLAVE | {"canBeInstantiatedOnlyOncePerProcess": "true"}))
    assert problems(report) == {}
    reason = "declares canBeInstantiatedOnlyOncePerProcess"
    several = ("two instances", "repeated instantiation", "state in another instance", "logging")
    assert {report.finding(name).detail for name in several} == {reason}


def test_honest_model_exchange_alone(tmp_path: Path) -> None:
    report = checked(tmp_path, xml=description(None, STATES))
    assert set(problems(report)) == {"interface"}
    assert report.clean
