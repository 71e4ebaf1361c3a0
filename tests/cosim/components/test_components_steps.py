"""Steps that do not go as asked: refused, shorter than asked, or not done yet; what is said, and what is computed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from coupled_runs import prepare, run
from mock_slaves import Counter, started
from test_fmus.events import awkward_fmu

from cosim.components.loading import load_fmu
from cosim.errors import RunError
from fmus.check.probe import probe


@pytest.mark.compiler
def test_who_comes_less_far_is_asked_again(tmp_path: Path) -> None:
    """y' = u comes 0.04 s far in a step of 0.1 s, and says so by an early return: three calls for each, and y = u t."""
    parts = [load_fmu(awkward_fmu(tmp_path, "short", version=3), "short")]
    ran = run(parts, [], 0.1, 20, starts={"short": {"u": 3.0}})
    np.testing.assert_allclose(ran["short.y"], 3.0 * ran["time"], rtol=1e-14, atol=1e-15)
    assert parts[0].calls == 60


@pytest.mark.compiler
@pytest.mark.parametrize("version", [1, 2, 3])
@pytest.mark.parametrize("step", [0.03, 0.1, 0.15, 0.3])
def test_the_last_successful_time_is_not_the_time_reached_without_an_early_return(
    tmp_path: Path, step: float, version: Any
) -> None:
    """y' = u in steps of its own of 0.1 s, as the Reference FMUs take them: y is held at the last one of them."""
    fmu = awkward_fmu(tmp_path, "own-steps", version=version, longest_step=0.1)
    parts = [load_fmu(fmu, "own")]
    ran = run(parts, [], step, 40, starts={"own": {"u": 3.0}})
    np.testing.assert_allclose(ran["own.y"], 0.3 * np.floor(ran["time"] / 0.1 + 1e-9), rtol=1e-13)
    assert parts[0].calls == 40
    report = probe(lambda: load_fmu(fmu, "own"), {}, 0.0, step)
    assert report.restores == ("exact" if version > 1 else "no"), report.remarks


@pytest.mark.parametrize("said", [0.0, -1.0, 0.05, 7.0])
def test_without_an_early_return_a_slave_may_say_any_last_time(said: float) -> None:
    class Careless(Counter):
        def doStep(self, t: float, h: float) -> tuple[bool, bool, bool, float]:
            super().doStep(t, h)
            return False, False, False, said

    made = started(Careless())
    made.advance(0.0, 0.1)
    assert (made.calls, made.time) == (1, 0.1)
    assert made.slave.x["total"] == pytest.approx(0.1, rel=1e-15)


OWN_WORDS = "The FMU says: a step of 0.1 s over 0.25 s is too long, at most 0.04 s"


@pytest.mark.compiler
@pytest.mark.parametrize(
    ("version", "behaviour", "message"),
    [
        (2, "discard", rf"doStep was discarded: asked for 0.3 s, it came to 0.25 s. {OWN_WORDS}"),
        (
            2,
            "discard-silently",
            rf"doStep was discarded: asked for 0.3 s, it does not say how far it came. {OWN_WORDS}",
        ),
        (3, "discard", rf"doStep was discarded: asked for 0.3 s. {OWN_WORDS}"),
        (2, "waits", r"doStep returned before it was done \(status pending\), as canRunAsynchronuously allows"),
        (2, "fails", r"doStep failed: .*status 3 \(error\)"),
        (3, "dies", r"doStep failed: .*status 4 \(fatal\)"),
    ],
)
def test_refused_steps_say_what_happened_and_keep_the_results(
    tmp_path: Path, version: Any, behaviour: Any, message: str
) -> None:
    master = prepare([load_fmu(awkward_fmu(tmp_path, behaviour, version=version), "awkward")], [], 0.1, 10)
    with pytest.raises(RunError, match=f"Component 'awkward' at t = 0.2 s: {message}"):
        master.run()
    assert master.recorder.table()["time"].tolist() == pytest.approx([0.0, 0.1, 0.2])


@pytest.mark.compiler
@pytest.mark.parametrize("version", [2, 3])
def test_a_step_that_is_short_enough_is_not_refused(tmp_path: Path, version: Any) -> None:
    """The FMU refuses steps over 0.25 s that are longer than 0.04 s."""
    ran = run([load_fmu(awkward_fmu(tmp_path, "discard", version=version), "awkward")], [], 0.04, 25)
    np.testing.assert_allclose(ran["awkward.y"], ran["time"], rtol=1e-14, atol=1e-15)
