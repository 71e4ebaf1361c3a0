"""Steps that do not go as asked: refused, shorter than asked, or not done yet; what is said, and what is computed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from coupled_runs import prepare, run
from mock_slaves import Counter, started
from zoo.events import awkward_fmu

from cosim.components.loading import load_fmu
from cosim.errors import RunError


@pytest.mark.compiler
@pytest.mark.parametrize("behaviour", ["short", "short-unsaid"])
def test_who_comes_less_far_is_asked_again(tmp_path: Path, behaviour: Any) -> None:
    """y' = u comes 0.04 s far in a step of 0.1 s: three calls for each, and y = u t to rounding; whether it says so by
    earlyReturn and lastSuccessfulTime or by the latter alone."""
    parts = [load_fmu(awkward_fmu(tmp_path, behaviour, version=3), "short")]
    ran = run(parts, [], 0.1, 20, starts={"short": {"u": 3.0}})
    np.testing.assert_allclose(ran["short.y"], 3.0 * ran["time"], rtol=1e-14, atol=1e-15)
    assert parts[0].calls == 60


@pytest.mark.parametrize(("reached", "asked_again"), [(0.0, False), (-1.0, False), (0.05, True), (7.0, False)])
def test_a_last_time_outside_of_the_step_counts_only_with_an_early_return(reached: float, asked_again: bool) -> None:
    """A slave that never fills in lastSuccessfulTime leaves there what was there."""

    class Careless(Counter):
        def doStep(self, t: float, h: float) -> tuple[bool, bool, bool, float]:
            end = reached if t == 0.0 and reached == 0.05 else t + h
            super().doStep(t, end - t)
            return False, False, False, reached if t == 0.0 else end

    made = started(Careless())
    made.advance(0.0, 0.1)
    assert (made.calls, made.time) == (2 if asked_again else 1, 0.1)
    assert made.slave.x["total"] == pytest.approx(0.1, rel=1e-15)


@pytest.mark.compiler
@pytest.mark.parametrize(
    ("version", "behaviour", "message"),
    [
        (2, "discard", r"doStep was discarded: asked for 0.3 s, it came to 0.25 s; try a smaller communication step"),
        (2, "discard-silently", r"doStep was discarded: asked for 0.3 s, it does not say how far it came; try a smaller"),
        (3, "discard", r"doStep was discarded: asked for 0.3 s; try a smaller communication step"),
        (2, "waits", r"doStep returned before it was done \(status pending\), as canRunAsynchronuously allows"),
        (2, "fails", r"doStep failed: .*status 3 \(error\)"),
        (3, "dies", r"doStep failed: .*status 4 \(fatal\)"),
    ],
)
def test_refused_steps_say_what_happened_and_keep_the_results(
    tmp_path: Path, version: Any, behaviour: Any, message: str
) -> None:  # fmt: skip
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
