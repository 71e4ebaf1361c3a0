"""Inputs between communication points: orders of accuracy against the closed form of the whole, and how slaves are
told.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from coupled_runs import Balises, Listener, Motion, Pushed, block, positions, run
from fmpy.fmi1 import FMICallException
from hypothesis import given, settings
from hypothesis import strategies as st
from linear_runs import LinearRun, load, prepare, run_cut
from mock_slaves import Counter, component
from test_fmus.masses import Chain, cuts

from cosim.errors import RunError
from cosim.master.algorithms.gauss_seidel import GaussSeidel
from cosim.master.algorithms.jacobi import Jacobi
from cosim.master.interpolation.first_order_hold import FirstOrderHold
from cosim.master.master import close

CHAIN = Chain.two(damping=0.1)
TELLINGS: dict[str, tuple[Any, dict[str, Any], str]] = {
    "FMI 1 derivatives": (1, {"input_derivatives": True}, "derivatives"),
    "FMI 2 derivatives": (2, {"input_derivatives": True}, "derivatives"),
    "FMI 3 intermediate": (3, {"inner_instants": 3, "inner_linear": True}, "intermediate"),
    "FMI 2 mean": (2, {}, "mean"),
    "FMI 3 mean": (3, {}, "mean"),
    "block": ("block3", {}, "mean"),
}


def halved(folder: Path, cut: str, steps: tuple[int, ...] = (50, 100, 200), **how: Any) -> list[LinearRun]:
    """Runs of one second."""
    return [run_cut(cuts(CHAIN)[cut], CHAIN, folder, 1.0 / n, n, **how) for n in steps]


def order(runs: list[LinearRun]) -> float:
    """Observed between the last two."""
    return float(np.log2(runs[-2].error / runs[-1].error))


@pytest.mark.parametrize("telling", TELLINGS)
@pytest.mark.parametrize("algorithm", [GaussSeidel, Jacobi])
def test_lines_raise_the_order_from_one_to_two(telling: str, algorithm: Any, tmp_path: Path) -> None:
    version, capabilities, interpolator = TELLINGS[telling]
    how = {"version": version, "capabilities": capabilities, "algorithm": algorithm}
    held = halved(tmp_path, "displacement-displacement", **how)
    lines = halved(tmp_path, "displacement-displacement", inputs="extrapolate", **how)
    assert set(lines[0].interpolators.values()) == {interpolator}
    # the next term of the expansion is a share of about h of the first
    assert order(held) == pytest.approx(1.0, abs=0.1)
    assert order(lines) == pytest.approx(2.0, abs=0.15)
    assert lines[-1].error < 0.05 * held[-1].error


def test_interpolation_alone_is_of_second_order_where_nothing_is_fed_back(tmp_path: Path) -> None:
    """Mass 1 alone moves mass 2: with its end known in every step, Gauss-Seidel needs no past."""
    cut = cuts(CHAIN)["displacement-displacement"]
    one_way = [c for c in cut.connections if c.startswith("mass1")]
    for telling in ("FMI 2 derivatives", "FMI 2 mean", "FMI 3 intermediate"):
        version, capabilities, _ = TELLINGS[telling]
        ends = []
        for n in (50, 100, 200, 1600):
            master, _ = prepare(load(cut, tmp_path, version, **capabilities), one_way, 1.0 / n, n, inputs="interpolate")
            master.run()
            close(master.plan)
            ends.append(master.recorder.table()["mass2.p"][-1])
        errors = np.abs(np.array(ends[:3]) - ends[3])
        assert np.log2(errors[1] / errors[2]) == pytest.approx(2.0, abs=0.1), telling


def test_a_mean_is_not_reported_where_the_output_follows_the_input_at_once(tmp_path: Path) -> None:
    """Documented limit: held inputs that act directly take the value of the end, and stay of first order."""
    means = halved(tmp_path, "force-displacement", inputs="extrapolate")
    reported = halved(tmp_path, "force-displacement", inputs="extrapolate", capabilities={"input_derivatives": True})
    assert order(means) == pytest.approx(1.0, abs=0.15)
    assert order(reported) == pytest.approx(2.0, abs=0.15)


def test_substeps_follow_the_line(tmp_path: Path) -> None:
    """Held means over n substeps come nearer to the line itself: their difference falls with n squared."""
    line = halved(
        tmp_path, "displacement-displacement", (50,), inputs="extrapolate", capabilities={"input_derivatives": True}
    )[0]
    distances = []
    for n in (1, 2, 4):
        means = halved(
            tmp_path, "displacement-displacement", (50,), inputs="extrapolate", substeps={"mass1": n, "mass2": n}
        )[0]
        distances.append(max(np.abs(means.table[s] - line.table[s]).max() for s in line.cut.signals.values()))
    assert distances[0] / distances[1] == pytest.approx(4.0, rel=0.1)
    assert distances[1] / distances[2] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("version", [1, 2])
def test_a_slave_that_refuses_a_slope_ends_the_run_in_words(version: int, tmp_path: Path) -> None:
    cut = cuts(CHAIN)["displacement-displacement"]
    parts = load(cut, tmp_path, version, input_derivatives=True)

    def refuse(*_arguments: Any) -> None:
        raise FMICallException(f"fmi{version}SetRealInputDerivatives", 3)

    setattr(parts["mass2"].slave, f"fmi{version}SetRealInputDerivatives", refuse)
    master, _ = prepare(parts, cut.connections, 0.1, 5, inputs="extrapolate")
    with pytest.raises(
        RunError, match=r"Component 'mass2' at t = 0 s: derivatives of p_left, v_left failed: fmi.SetReal"
    ):
        master.run()
    close(master.plan)


def test_without_connected_inputs_lines_change_nothing() -> None:
    seen = [run([block(Pushed(), "p")], [], 0.1, 5)["p.position"] for _ in range(2)]
    np.testing.assert_array_equal(*seen)


# -- the line itself
# ------------------------------------------------------------------------------------------------------


@given(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.lists(st.floats(0.01, 1.0), min_size=2, max_size=6))
@settings(max_examples=50)
def test_a_line_is_exact_for_what_is_linear_whatever_the_steps(a: float, b: float, steps: list[float]) -> None:
    source = component(Counter(), "source")
    hold = FirstOrderHold("extrapolate", [source], np.array([True]))
    t = 0.0
    for h in steps:
        source.time = t
        hold.update(np.array([a + b * t]), t + h)
        t += h
    for s in (t - steps[-1], t, t + 1.0):  # a difference of two roundings over a step of 0.01 s
        assert hold.at(s)[0] == pytest.approx(a + b * s, abs=1e-12)


def test_no_line_leads_over_a_jump_and_saved_lines_come_back() -> None:
    source = component(Counter(), "source")
    hold = FirstOrderHold("extrapolate", [source], np.array([True]))
    for t, value in ((0.0, 1.0), (0.1, 2.0)):
        source.time = t
        hold.update(np.array([value]), t + 0.1)
    saved = hold.save()
    assert hold.at(0.2)[0] == pytest.approx(3.0)
    hold.forget(np.array([True]))
    source.time = 0.2
    hold.update(np.array([50.0]), 0.3)
    assert hold.at(0.3)[0] == 50.0
    hold.restore(saved)
    hold.update(np.array([3.0]), 0.3)
    assert hold.at(0.3)[0] == pytest.approx(4.0)


def test_where_no_number_holds_the_slope_the_value_is_held() -> None:
    source = component(Counter(), "source")
    hold = FirstOrderHold("extrapolate", [source], np.array([True]))
    for t, value in ((0.0, -1e308), (0.1, 1e308)):
        source.time = t
        hold.update(np.array([value]), t + 0.1)
    assert hold.at(0.2)[0] == 1e308


def test_discrete_inputs_are_held() -> None:
    hold = FirstOrderHold("extrapolate", [component(Counter(), "source")] * 2, np.array([True, False]))
    for t in (0.0, 0.1):
        for c in hold._distinct:
            c.time = t
        hold.update(np.array([t, t]), t + 0.1)
    np.testing.assert_allclose(hold.at(0.2), [0.2, 0.1])


def test_interpolation_holds_where_the_end_is_not_known() -> None:
    source = component(Counter(), "source")
    hold = FirstOrderHold("interpolate", [source], np.array([True]))
    for t in (0.0, 0.1):
        source.time = t
        hold.update(np.array([t]), t + 0.1)
    assert hold.at(0.2)[0] == 0.1
    hold.update(np.array([0.3]), 0.2, ends_known=True)  # the source still stands at 0.1
    assert hold.at(0.15)[0] == pytest.approx(0.2)


def test_a_value_that_is_corrected_replaces_the_last_one() -> None:
    """A step that is iterated updates the same line again and again; where it began stays."""
    source = component(Counter(), "source")
    hold = FirstOrderHold("interpolate", [source], np.array([True]))
    source.time = 0.0
    hold.update(np.array([1.0]), 0.1)
    for guess in (5.0, 3.0, 2.0):
        hold.update(np.array([guess]), 0.1, ends_known=True)
        assert hold.at(0.0)[0] == pytest.approx(1.0)
        assert hold.at(0.1)[0] == pytest.approx(guess)


def test_balises_are_received_at_their_own_instants_with_lines_too() -> None:
    """The receiver follows the line in each part of its step: a speed that grows linearly integrates to the distance
    exactly.
    """
    parts = [block(Motion(), "plant"), block(Listener(), "listener")]
    balises = Balises(positions(3.3, 7.1, 11.0), receivers=["listener"])
    starts = {"plant": {"v0": 5.0, "a": 2.0}}
    seen = run(parts, [("plant.speed", "listener.speed")], 0.1, 20, balises, starts=starts, inputs="interpolate")
    assert seen["listener.heard"][-1] == 3.0
    at_balises = np.isin(seen.time, [e.stamp for e in seen.events])
    assert at_balises.sum() == 6
    # stamps are exact to 1e-11 s
    np.testing.assert_allclose(seen["listener.integrated"], seen["plant.position"], atol=1e-9)
