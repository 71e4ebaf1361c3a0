"""Two coupled masses in a master that knows nothing of this package: the same trajectory, to the last digits."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description
from linear_runs import run_cut
from scipy.linalg import expm
from test_fmus.masses import Chain, Cut, cuts

from cosim import Scenario
from cosim.master.algorithms.jacobi import Jacobi

pytestmark = [pytest.mark.compiler, pytest.mark.foreign]

CHAIN = Chain.two(damping=0.1)
STEP, STEPS = 0.01, 300
ROUNDING = 1e-12  # libcosim hands over the difference of two communication points, not one and the same length


def libcosim(cut: Cut, folder: Path) -> dict[str, np.ndarray]:
    """libcosim's fixed-step algorithm: inputs and outputs are exchanged at initialisation, then all step at once."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    log_output_level(CosimLogLevel.FATAL)
    execution = CosimExecution.from_step_size(step_size=round(STEP * 1e9))
    slaves, references = {}, {}
    for name, path in cut.fmus(folder, 2).items():
        slaves[name] = execution.add_local_slave(CosimLocalSlave(str(path), instance_name=name))
        references[name] = {v.name: v.valueReference for v in read_model_description(str(path)).modelVariables}
    for connection in cut.connections:
        (a, y), (b, u) = (end.split(".") for end in connection.split(" -> "))
        execution.connect_real_variables(slaves[a], references[a][y], slaves[b], references[b][u])
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    signals = {signal: signal.split(".") for signal in cut.signals.values()}
    table = {signal: np.zeros(STEPS + 1) for signal in signals}
    for k in range(STEPS + 1):
        assert k == 0 or execution.step(1)
        for signal, (name, port) in signals.items():
            if k:
                (table[signal][k],) = observer.last_real_values(slaves[name], [references[name][port]])
    return table


@pytest.mark.parametrize("name", ["displacement-displacement", "force-displacement"])
def test_the_trajectory_is_that_of_libcosim(name: str, tmp_path: Path) -> None:
    """Exchange at initialisation, Jacobi, held inputs: both do the same sums, so nothing but their rounding may
    differ.
    """
    cut = cuts(CHAIN)[name]
    foreign = libcosim(cut, tmp_path)
    ours = run_cut(cut, CHAIN, tmp_path, STEP, STEPS, algorithm=Jacobi)
    for signal in cut.signals.values():
        np.testing.assert_allclose(ours.table[signal][1:], foreign[signal][1:], rtol=0.0, atol=ROUNDING)
    moved = max(np.ptp(foreign[signal][1:]) for signal in cut.signals.values())
    assert moved > 0.5


def by_hand(cut: Cut, steps: int, exchange: bool) -> dict[str, float]:
    """The last positions and speeds of Jacobi with held inputs, by the matrix exponential of each part."""
    states = {n: np.array(p.x0) for n, p in cut.parts.items()}
    links = [tuple(end.split(".") for end in c.split(" -> ")) for c in cut.connections]
    seen = {n: dict.fromkeys(p.outputs, 0.0) for n, p in cut.parts.items()}
    for k in range(steps):
        if k or exchange:
            # no direct feedthrough
            seen = {n: dict(zip(p.outputs, p.C @ states[n], strict=True)) for n, p in cut.parts.items()}
        for n, p in cut.parts.items():
            u = np.array([next(seen[a][y] for (a, y), (b, i) in links if (b, i) == (n, name)) for name in p.inputs])
            size = len(p.x0)
            both = np.zeros((size + len(u),) * 2)
            both[:size] = np.hstack([p.A, p.B]) * STEP
            states[n] = (expm(both) @ np.concatenate([states[n], u]))[:size]
    return {f"{n}.{y}": float(v) for n, p in cut.parts.items() for y, v in zip(p.outputs, p.C @ states[n], strict=True)}


def test_without_the_exchange_at_initialisation_it_is_another_one(tmp_path: Path) -> None:
    """The same algorithm by hand: with the exchange it is the run above, without it the third digit is wrong."""
    cut = cuts(CHAIN)["displacement-displacement"]
    foreign = libcosim(cut, tmp_path)
    exchanged, blind = (by_hand(cut, STEPS, exchange) for exchange in (True, False))
    for signal in cut.signals.values():
        assert abs(exchanged[signal] - foreign[signal][-1]) < ROUNDING
    assert max(abs(blind[signal] - foreign[signal][-1]) for signal in cut.signals.values()) > 1e-3


def test_libcosim_runs_our_system_structure(tmp_path: Path) -> None:
    """A scenario written as SSP 1.0: another tool reads the structure and comes to the same numbers."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver

    cut = cuts(CHAIN)["displacement-displacement"]
    scenario = Scenario(stop=STEPS * STEP, step=STEP, master={"algorithm": "jacobi"})
    for name, path in cut.fmus(tmp_path, 2).items():
        scenario.add(name, fmu=str(path))
    scenario.connect(*cut.connections).export_ssp(tmp_path / "masses.ssp", version="1.0")
    ours = scenario.run()
    with zipfile.ZipFile(tmp_path / "masses.ssp") as archive:
        archive.extractall(tmp_path / "masses")
    execution = CosimExecution.from_ssp_file(str(tmp_path / "masses"), round(STEP * 1e9))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    assert all(execution.step(1) for _ in range(STEPS))
    for signal in cut.signals.values():
        name, port = signal.split(".")
        slave = execution.slave_index_from_instance_name(name)
        references = {v.name.decode(): v.reference for v in execution.slave_variables(slave)}
        (foreign,) = observer.last_real_values(slave, [references[port]])
        assert abs(foreign - ours[signal][-1]) < ROUNDING
