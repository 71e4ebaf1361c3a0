"""Which solver for windows that are solved to convergence: one window of the train, 200 readings and 20 balises.

``python docs/studies/moving_horizon_solvers.py`` prints the table of docs/theses/moving_horizon.md, with ``--write`` it
puts it there. All solve the same quadratic programmes within the same Gauss-Newton steps, one from the solution of the
window before; IPOPT and SciPy have the whole problem to themselves.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from time import thread_time

import casadi as ca
import clarabel
import numpy as np
import scipy.optimize
import scipy.sparse
from page_tables import write_table

from fmu_observer.formulas.filtering.square_root import factor
from fmu_observer.formulas.moving_horizon.arrival_cost import ArrivalCost, arrival_cost_at
from fmu_observer.formulas.moving_horizon.full_solution import Effort, FullSolution
from fmu_observer.formulas.moving_horizon.full_solver import FullSolver
from fmu_observer.formulas.moving_horizon.gauss_newton import passed
from fmu_observer.formulas.moving_horizon.row_window import WindowRow
from fmu_observer.formulas.moving_horizon.window_program import Programme, WindowProgram
from fmu_observer.observers.train.balise_moving_horizon import LAYOUT, BaliseMovingHorizon, Shared

PAGE = Path(__file__).parents[1] / "theses" / "moving_horizon.md"
READINGS, BALISES, WINDOWS = 200, 20, 12
ORDER = 4
DISTURBANCE_LIMIT = 0.003  # [m/s2]: tight, so that it is active in part of the window
EFFORT = Effort(1e-4)
HEADING = (
    "solver of the quadratic programmes", "CPU time a window, median [ms]", "largest [ms]", "Gauss-Newton steps",
    "off the first, largest [standard deviations]", "converged",
)  # fmt: skip


class ClarabelProgram(WindowProgram):
    """The quadratic programme handed to Clarabel."""

    def handed(self, stated: Programme) -> tuple[np.ndarray, np.ndarray, str]:
        """See `WindowProgram.handed`; no disturbance has bounds here."""
        h, g, a, (right, _), lower, upper = stated
        P, E = _matrix(self.cost, h), _matrix(self.transitions, a)
        eye = scipy.sparse.eye(len(g), format="csr")
        has_low, has_high = np.isfinite(lower), np.isfinite(upper)
        rows = scipy.sparse.vstack([E, eye[has_high], -eye[has_low]]).tocsc()
        limits = np.concatenate([right, upper[has_high], -lower[has_low]])
        cones = [clarabel.ZeroConeT(len(right)), clarabel.NonnegativeConeT(len(limits) - len(right))]
        settings = clarabel.DefaultSettings()
        settings.verbose, settings.tol_gap_abs, settings.tol_feas = False, 1e-9, 1e-9
        reported = clarabel.DefaultSolver(scipy.sparse.triu(P, format="csc"), g, rows, limits, cones, settings).solve()
        status = "SOLVER_RET_SUCCESS" if "Solved" in str(reported.status) else str(reported.status)
        return np.array(reported.x), np.array(reported.z)[: len(right)], status


class IpoptProgram(WindowProgram):
    """The same programme handed to IPOPT with its exact second derivatives."""

    def __init__(self, count: int, order: int) -> None:
        super().__init__(count, order)
        size = 2 * count * order
        z, g = ca.MX.sym("z", size), ca.MX.sym("g", size)
        h, a = ca.MX.sym("h", self.cost.nnz()), ca.MX.sym("a", self.transitions.nnz())
        cost = 0.5 * ca.dot(z, ca.MX(self.cost, h) @ z) + ca.dot(g, z)
        options = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-9}}
        problem = {"x": z, "p": ca.vertcat(g, h, a), "f": cost, "g": ca.MX(self.transitions, a) @ z}
        self._ipopt = ca.nlpsol("window", "ipopt", problem, options)

    def handed(self, stated: Programme) -> tuple[np.ndarray, np.ndarray, str]:
        """See `WindowProgram.handed`; no disturbance has bounds here."""
        h, g, a, (least, most), lower, upper = stated
        p = np.concatenate([g, h, a])
        reported = self._ipopt(x0=np.zeros(len(g)), p=p, lbx=lower, ubx=upper, lbg=least, ubg=most)
        status = str(self._ipopt.stats()["unified_return_status"])
        return reported["x"].full().ravel(), reported["lam_g"].full().ravel(), status


class TrustRegionProgram(WindowProgram):
    """The same programme as bounded least squares of SciPy: equations weighted by 1e6, `lsq_linear` with LSMR."""

    def handed(self, stated: Programme) -> tuple[np.ndarray, np.ndarray, str]:
        """See `WindowProgram.handed`; no disturbance has bounds here."""
        h, g, a, (right, _), lower, upper = stated
        size = len(g)
        blocks = h[: size // 2 * self.order].reshape(self.count, self.order, self.order)
        values, vectors = np.linalg.eigh(blocks)
        roots = np.sqrt(np.maximum(values, 0.0))[:, :, None] * vectors.transpose(0, 2, 1)
        inverse = np.where(values > 1e-12, 1.0 / np.sqrt(np.maximum(values, 1e-12)), 0.0)
        wanted = -np.einsum("ki,kji,kj->ki", inverse, vectors, g[: size // 2].reshape(self.count, -1))
        residuals = scipy.sparse.block_diag([*roots, scipy.sparse.eye(size // 2)])
        stacked = scipy.sparse.vstack([residuals, 1e6 * _matrix(self.transitions, a)]).tocsr()
        goal = np.concatenate([wanted.ravel(), np.zeros(size // 2), 1e6 * right])
        found = scipy.optimize.lsq_linear(stacked, goal, (lower, upper), lsq_solver="lsmr", max_iter=50)
        return found.x, np.zeros(len(right)), "SOLVER_RET_SUCCESS" if found.success else "not solved"


def _matrix(sparsity: ca.Sparsity, values: np.ndarray) -> scipy.sparse.csc_matrix:
    return scipy.sparse.csc_matrix((values, sparsity.row(), sparsity.colind()), shape=sparsity.shape)


SOLVERS: dict[str, Callable[[int, int], WindowProgram]] = {
    "PIQP (in CasADi)": WindowProgram,
    "OSQP (in CasADi)": lambda count, order: WindowProgram(
        count, order, "osqp", {"verbose": False, "eps_abs": 1e-7, "eps_rel": 1e-7, "max_iter": 20000}
    ),
    "ProxQP (in CasADi)": lambda count, order: WindowProgram(count, order, "proxqp", {}),
    "Clarabel": ClarabelProgram,
    "IPOPT (in CasADi)": IpoptProgram,
    "SciPy lsq_linear, trust region": TrustRegionProgram,
}


def window_rows(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows of a drawn run, and true states: readings every 0.2 s, balises every 2 s between them.

    Args:
        count: rows.
    """
    rng, problem = np.random.default_rng(7), BaliseMovingHorizon().problem
    shared = parameters()
    stamps = sorted([(0.2 * k, 0.0) for k in range(1, count)] + [(2.0 * k + 0.13, 1.0) for k in range(count // 10 + 1)])
    x, t, rows, states = np.array([0.0, 30.0, 0.0, 0.1]), 0.0, [], []
    for stamp, balise in stamps[:count]:
        push = 0.3 * np.sin(0.2 * stamp) * (stamp - t)
        row = WindowRow(1.0, stamp - t, stamp, np.array([0.0, push, 0.0, 0.0, x[1], balise]), np.zeros(1), np.ones(1))
        moved = problem.moved(x, row, shared)
        x, t = moved.state + np.asarray(factor(moved.noise)) @ rng.standard_normal(ORDER), stamp
        seen = problem.seen(x, row, shared)
        y = seen.measured + np.sqrt(seen.noise.diagonal()) * rng.standard_normal(1)
        rows.append(LAYOUT.packed(row._replace(measured=y)).tolist())
        states.append(x)
    return np.array(rows), np.array(states)


def parameters() -> np.ndarray:
    """Parameters of the train observer, its bound of the disturbance tight."""
    system = BaliseMovingHorizon()
    values = system.unpack_parameters(system.start_parameters())
    reported = {name: float(getattr(values, name)) for name in Shared._fields} | {
        "disturbance_limit": DISTURBANCE_LIMIT
    }
    return np.array(list(reported.values()))


def warm_started(
    program: Callable[[int, int], WindowProgram], windows: int = WINDOWS
) -> tuple[list[float], list[FullSolution]]:
    """CPU seconds and solutions of windows that move on by a row each; the first one is not counted.

    Args:
        program: what solves the quadratic programmes. windows: how many.
    """
    count = READINGS + BALISES
    problem, shared = BaliseMovingHorizon(loss="squares").problem, parameters()
    rows, truth = window_rows(count + windows)
    made: dict[tuple[int, int], WindowProgram] = {}
    solver = FullSolver(problem, lambda *size: made.get(size) or made.setdefault(size, program(*size)))
    arrival = arrival_cost_at(np.array([0.0, 30.0, 0.0, 0.0]), np.diag([1.0, 1.0, 0.01, 0.1]))
    points, spent, found = truth[:count].copy(), [], []
    for k in range(windows + 1):
        window = rows[k : k + count]
        began = thread_time()
        solution = solver.solve(arrival, window, points, shared, EFFORT)
        spent.append(thread_time() - began)
        found.append(solution)
        arrival = ArrivalCost(*map(np.asarray, passed(problem, arrival, window[0], solution.states[0], shared)))
        if k < windows:
            ahead = problem.moved(solution.estimate, LAYOUT.unpacked(rows[k + count]), shared).state
            points = np.vstack([solution.states[1:], ahead])
    return spent[1:], found[1:]


def main() -> None:
    """Print the table, or write it into the page."""
    rows = []
    _, reference = warm_started(WindowProgram)
    scale = np.sqrt(reference[-1].covariance.diagonal())
    for name, program in SOLVERS.items():
        try:
            spent, found = warm_started(program, WINDOWS if program in (WindowProgram, ClarabelProgram) else 3)
        except Exception as error:  # a solver that gives up has its line
            rows.append([name, "-", "-", "-", "-", f"no: {str(error).partition(';')[0]}"])
            continue
        off = max(float(np.abs((f.states - r.states) / scale).max()) for f, r in zip(found, reference, strict=False))
        steps = np.mean([f.iterations for f in found])
        reported = f"{sum(f.converged for f in found)} of {len(found)}"
        rows.append(
            [name, f"{1e3 * np.median(spent):.1f}", f"{1e3 * max(spent):.1f}", f"{steps:.1f}", f"{off:.0e}", reported]
        )
    lines = [HEADING, ["---"] * len(HEADING), *rows]
    text = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    print(text)
    if "--write" in sys.argv:
        write_table(PAGE, "solvers", text)


if __name__ == "__main__":
    main()
