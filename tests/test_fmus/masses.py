"""Chains of masses, springs and dampers between two walls, cut into components in every way, with the closed form of
the whole.

    from test_fmus.masses import Chain, cuts
    chain = Chain.two()
    cut = cuts(chain)["force-displacement"]
    fmus = cut.fmus(tmp_path, version=2)                 # {"mass1": Path, "mass2": Path}
    systems = cut.systems()                              # the same as hybrid systems
    cut.connections                                      # ["mass1.p -> mass2.p_left", ...]
    whole = chain.reference(times)                       # whole.positions, whole.speeds, whole.energy
    cut.signals["p1"]                                    # "mass1.p"

The cuts:

- ``whole``: the monolith, one component.
- ``displacement-displacement``: every mass with copies of its springs; positions and speeds both ways. No direct
  feedthrough.
- ``force-displacement``: every mass with the spring to its left; positions and speeds to the right, forces to the left.
  A force depends directly on the position and speed to its left; no loop.
- ``force-force``: masses and springs apart; positions and speeds to the springs, forces back. The springs have no
  states and depend directly on all their inputs; no loop.
- ``inertial``: as ``force-force``, and a part of every mass sits in the spring to its right, which takes the
  acceleration: every such pair is an algebraic loop.

A cut with only forces on both sides and no component between them does not exist: something must compute the force.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import expm
from test_fmus.build import linear_fmu
from test_fmus.description import Version

from plant_models.hybrid import HybridSystem, input_signal, output_signal, state

UNITS = {"p": "m", "v": "m/s", "f": "N", "a": "m/s2"}
"""By the first letter of a signal."""


@dataclass(frozen=True)
class Part:
    """A linear component: ``x' = A x + B u``, ``y = C x + D u`` from x0; names of inputs and outputs."""

    name: str
    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    x0: tuple[float, ...]

    @property
    def units(self) -> dict[str, str]:
        """Units of inputs and outputs, by the first letter of their names; other names have none."""
        return {
            n: UNITS[n[0]]
            for n in (*self.inputs, *self.outputs)
            if n[0] in UNITS and (len(n) == 1 or n[1] in "_123456789")
        }

    def fmu(self, folder: Path, version: Version = 3, **capabilities: Any) -> Path:
        """As an FMU; capabilities as for `test_fmus.build.linear_fmu`."""
        return linear_fmu(
            folder,
            self.name,
            self.A,
            self.B,
            self.C,
            self.D,
            version=version,
            inputs=self.inputs,
            outputs=self.outputs,
            x0=self.x0,
            units=self.units,
            **capabilities,
        )

    def system(self, internal_step: float = 1e-3) -> HybridSystem:
        """As a hybrid system, integrated by RK4 with this internal step [s]: error about ``(w h)^4 / 120`` of the
        amplitude.
        """
        return linear_system(self, internal_step)


def linear_system(part: Part, step: float) -> HybridSystem:
    """A linear component as a hybrid system; its states are ``x1``, ``x2``, ..."""
    n, units = len(part.x0), part.units

    def rows(left: np.ndarray, right: np.ndarray, x: Any, u: Any) -> list[Any]:
        return [
            sum((float(left[i, j]) * value for j, value in enumerate(x)), 0.0)
            + sum((float(right[i, j]) * getattr(u, name) for j, name in enumerate(part.inputs)), 0.0)
            for i in range(len(left))
        ]

    class Linear(HybridSystem):
        name = part.name
        states = tuple(state(f"x{i + 1}", "1", part.x0[i]) for i in range(n))
        inputs = tuple(input_signal(v, units.get(v, "1")) for v in part.inputs)
        outputs = tuple(output_signal(v, units.get(v, "1")) for v in part.outputs)
        internal_step = step

        def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
            return {s.name: row for s, row in zip(self.states, rows(part.A, part.B, x, u), strict=True)}

        def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
            return dict(zip(part.outputs, rows(part.C, part.D, x, u), strict=True))

    return Linear()


@dataclass(frozen=True)
class Cut:
    """Components of a whole, and what belongs together.

    Args:
        parts: by name. connections: as in a scenario, ``a.y -> b.u``. signals: quantity of the whole (``p1``, ``v1``,
            ...) -> where it can be read, ``component.output``. loops: groups of components in algebraic loops.
    """

    name: str
    parts: Mapping[str, Part]
    connections: tuple[str, ...]
    signals: Mapping[str, str]
    loops: tuple[tuple[str, ...], ...] = ()

    def fmus(self, folder: Path, version: Version = 3, **capabilities: Any) -> dict[str, Path]:
        """All parts as FMUs, by name; capabilities as for `test_fmus.build.linear_fmu`."""
        return {name: part.fmu(folder, version, **capabilities) for name, part in self.parts.items()}

    def systems(self, internal_step: float = 1e-3) -> dict[str, HybridSystem]:
        """All parts as hybrid systems, by name."""
        return {name: part.system(internal_step) for name, part in self.parts.items()}


@dataclass(frozen=True)
class Reference:
    """The whole at some times: positions and speeds of shape (len(t), masses), energy of shape (len(t),)."""

    positions: np.ndarray
    speeds: np.ndarray
    energy: np.ndarray

    def __getitem__(self, quantity: str) -> np.ndarray:
        """``p1``, ``v2``, ..."""
        return {"p": self.positions, "v": self.speeds}[quantity[0]][:, int(quantity[1:]) - 1]


@dataclass(frozen=True)
class Chain:
    """Masses [kg] in a row between two walls; one spring [N/m] and damper [N.s/m] more than masses.

    Args:
        masses: shape (n,). stiffness, damping: shape (n + 1,), wall to wall. positions [m], speeds [m/s]: shape (n,),
        at time 0.
    """

    masses: tuple[float, ...]
    stiffness: tuple[float, ...]
    damping: tuple[float, ...]
    positions: tuple[float, ...]
    speeds: tuple[float, ...]

    @staticmethod
    def two(damping: float = 0.0) -> Chain:
        """Two masses; lightly coupled, so that every order of stepping is stable at steps of some 10 ms."""
        return Chain((1.0, 2.0), (10.0, 6.0, 20.0), (damping,) * 3, (1.0, -0.5), (0.0, 0.3))

    @staticmethod
    def three(damping: float = 0.0) -> Chain:
        """Three masses."""
        return Chain((1.0, 2.0, 1.5), (10.0, 6.0, 4.0, 20.0), (damping,) * 4, (1.0, -0.5, 0.2), (0.0, 0.3, -0.1))

    @property
    def count(self) -> int:
        """Number of masses."""
        return len(self.masses)

    def matrices(self) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness and damping matrix, shape (n, n)."""
        return tuple(  # type: ignore[return-value]
            np.diag(np.add(c[:-1], c[1:])) - np.diag(c[1:-1], 1) - np.diag(c[1:-1], -1)
            for c in (np.array(self.stiffness), np.array(self.damping))
        )

    def system_matrix(self) -> np.ndarray:
        """Of the states ``p1 .. pn, v1 .. vn``, shape (2 n, 2 n)."""
        stiffness, damping = self.matrices()
        inverse = np.diag(1.0 / np.array(self.masses))
        return np.block([[np.zeros_like(inverse), np.eye(self.count)], [-inverse @ stiffness, -inverse @ damping]])

    def reference(self, times: Sequence[float] | np.ndarray) -> Reference:
        """The exact motion by the matrix exponential of the whole, each time from the start.

        Args:
            times: [s], shape (k,).
        """
        start, matrix, n = np.array((*self.positions, *self.speeds)), self.system_matrix(), self.count
        states = np.array([expm(matrix * t) @ start for t in np.asarray(times, dtype=float)])
        return self.of_states(states[:, :n], states[:, n:])

    def of_states(self, positions: np.ndarray, speeds: np.ndarray) -> Reference:
        """Energy [J] added to measured positions and speeds, shape (k, n)."""
        stiffness, _ = self.matrices()
        potential = 0.5 * np.einsum("ki,ij,kj->k", positions, stiffness, positions)
        return Reference(positions, speeds, potential + 0.5 * speeds**2 @ np.array(self.masses))


def cuts(chain: Chain, inertia: float = 0.4) -> dict[str, Cut]:
    """All cuts of a chain, by name.

    Args:
        chain: the whole. inertia: for the cut ``inertial``: the part of every mass but the last that sits in the spring
            to its right; the loop gain is ``-inertia / (1 - inertia)``: repeated substitution converges below 0.5 and
            diverges above.
    """
    made = (
        _whole(chain),
        _displacement(chain),
        _force_displacement(chain),
        _force_force(chain),
        _inertial(chain, inertia),
    )
    return {cut.name: cut for cut in made}


def _signals(chain: Chain) -> dict[str, str]:
    numbers = range(1, chain.count + 1)
    return {f"p{i}": f"mass{i}.p" for i in numbers} | {f"v{i}": f"mass{i}.v" for i in numbers}


def _mass(chain: Chain, i: int, k: float, c: float, inputs: Mapping[str, float], share: float = 1.0) -> Part:
    """Mass i (from 0) on a spring k and damper c to the ground; each input times its factor is a force on it."""
    m = share * chain.masses[i]
    effect = np.array(list(inputs.values())) / m
    return Part(
        f"mass{i + 1}",
        np.array([[0.0, 1.0], [-k / m, -c / m]]),
        np.vstack([np.zeros_like(effect), effect]),
        np.eye(2),
        np.zeros((2, len(effect))),
        tuple(inputs),
        ("p", "v"),
        (chain.positions[i], chain.speeds[i]),
    )


def _own(chain: Chain, i: int, left: bool, right: bool) -> tuple[float, float]:
    """Stiffness and damping that mass i feels to the ground, from the springs on these sides."""
    sides = [s for s, wanted in ((i, left), (i + 1, right)) if wanted]
    return sum(chain.stiffness[s] for s in sides), sum(chain.damping[s] for s in sides)


def _whole(chain: Chain) -> Cut:
    n = chain.count
    names = tuple(f"{q}{i + 1}" for q in "pv" for i in range(n))
    part = Part(
        "whole",
        chain.system_matrix(),
        np.zeros((2 * n, 0)),
        np.eye(2 * n),
        np.zeros((2 * n, 0)),
        (),
        names,
        (*chain.positions, *chain.speeds),
    )
    return Cut("whole", {"whole": part}, (), {name: f"whole.{name}" for name in names})


def _displacement(chain: Chain) -> Cut:
    parts, connections = {}, []
    for i in range(chain.count):
        inputs: dict[str, float] = {}
        for side, j, s in (("left", i - 1, i), ("right", i + 1, i + 1)):
            if 0 <= j < chain.count:
                inputs |= {f"p_{side}": chain.stiffness[s], f"v_{side}": chain.damping[s]}
                connections += [f"mass{j + 1}.{q} -> mass{i + 1}.{q}_{side}" for q in "pv"]
        part = _mass(chain, i, *_own(chain, i, True, True), inputs)
        parts[part.name] = part
    return Cut("displacement-displacement", parts, tuple(connections), _signals(chain))


def _force_displacement(chain: Chain) -> Cut:
    parts, connections, last = {}, [], chain.count - 1
    for i in range(chain.count):
        k, c = chain.stiffness[i], chain.damping[i]
        inputs = ({"p_left": k, "v_left": c} if i > 0 else {}) | ({"f_right": 1.0} if i < last else {})
        part = _mass(chain, i, *_own(chain, i, True, i == last), inputs)
        if i > 0:  # the spring to the left is here: it pulls the left mass with k (p - p_left) + c (v - v_left)
            pull = np.array([[-{"p_left": k, "v_left": c}.get(name, 0.0) for name in inputs]])
            part = Part(
                part.name,
                part.A,
                part.B,
                np.vstack([part.C, [k, c]]),
                np.vstack([part.D, pull]),
                part.inputs,
                (*part.outputs, "f_left"),
                part.x0,
            )
            connections += [f"mass{i}.{q} -> mass{i + 1}.{q}_left" for q in "pv"] + [
                f"mass{i + 1}.f_left -> mass{i}.f_right"
            ]
        parts[part.name] = part
    return Cut("force-displacement", parts, tuple(connections), _signals(chain))


def _spring(chain: Chain, s: int, carried: float = 0.0) -> Part:
    """The spring between masses s and s + 1 (from 1): forces on both; with `carried` mass that moves with the left
    one.
    """
    k, c = chain.stiffness[s], chain.damping[s]
    pull = np.array([[-k, -c, k, c], [k, c, -k, -c]])
    names: tuple[str, ...] = ("p_left", "v_left", "p_right", "v_right")
    if carried:
        pull, names = np.hstack([pull, [[-carried], [0.0]]]), (*names, "a_left")
    return Part(
        f"spring{s}",
        np.zeros((0, 0)),
        np.zeros((0, len(names))),
        np.zeros((2, 0)),
        pull,
        names,
        ("f_left", "f_right"),
        (),
    )


def _force_force(chain: Chain) -> Cut:
    parts: dict[str, Part] = {}
    connections: list[str] = []
    _apart(chain, parts, connections, [1.0] * chain.count)
    return Cut("force-force", parts, tuple(connections), _signals(chain))


def _inertial(chain: Chain, inertia: float) -> Cut:
    parts: dict[str, Part] = {}
    connections: list[str] = []
    last = chain.count - 1
    _apart(chain, parts, connections, [1.0 - inertia] * last + [1.0])
    for i in range(last):
        mass = parts[f"mass{i + 1}"]
        parts[mass.name] = Part(  # a third output: its acceleration, which feels the forces at once
            mass.name,
            mass.A,
            mass.B,
            np.vstack([mass.C, mass.A[1]]),
            np.vstack([mass.D, mass.B[1]]),
            mass.inputs,
            (*mass.outputs, "a"),
            mass.x0,
        )
        parts[f"spring{i + 1}"] = _spring(chain, i + 1, inertia * chain.masses[i])
        connections.append(f"mass{i + 1}.a -> spring{i + 1}.a_left")
    pairs = tuple((f"mass{i}", f"spring{i}") for i in range(1, last + 1))
    return Cut("inertial", parts, tuple(connections), _signals(chain), pairs)


def _apart(chain: Chain, parts: dict[str, Part], connections: list[str], shares: Sequence[float]) -> None:
    last = chain.count - 1
    for i in range(chain.count):
        inputs = ({"f_left": 1.0} if i > 0 else {}) | ({"f_right": 1.0} if i < last else {})
        parts[f"mass{i + 1}"] = _mass(chain, i, *_own(chain, i, i == 0, i == last), inputs, shares[i])
        if i < last:
            s = i + 1
            parts[f"spring{s}"] = _spring(chain, s)
            connections += [f"mass{s}.{q} -> spring{s}.{q}_left" for q in "pv"]
            connections += [f"mass{s + 1}.{q} -> spring{s}.{q}_right" for q in "pv"]
            connections += [f"spring{s}.f_left -> mass{s}.f_right", f"spring{s}.f_right -> mass{s + 1}.f_left"]


# -- a loop without states
# ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Loop:
    """Two components without dynamics: ``first.y = a first.u + b``, ``second.y = c second.u + d``, each fed by the
    other.

    Repeated substitution multiplies the error by ``a c`` a round: it converges for ``|a c| < 1``; Newton finds the
    solution at once wherever ``a c`` is not 1. `b` and `d` are the start values of a state that stays, so they are
    parameters ``x0[1]``.
    """

    a: float = 0.5
    b: float = 1.0
    c: float = -0.8
    d: float = 2.0
    connections: tuple[str, ...] = field(default=("first.y -> second.u", "second.y -> first.u"))

    @property
    def gain(self) -> float:
        """Of one round."""
        return self.a * self.c

    @property
    def solution(self) -> tuple[float, float]:
        """``first.y`` and ``second.y``."""
        first = (self.a * self.d + self.b) / (1.0 - self.gain)
        return first, self.c * first + self.d

    @property
    def parts(self) -> dict[str, Part]:
        """The two components, by name."""
        still = np.zeros((1, 1))
        return {
            name: Part(name, still, still, np.ones((1, 1)), np.array([[gain]]), ("u",), ("y",), (offset,))
            for name, gain, offset in (("first", self.a, self.b), ("second", self.c, self.d))
        }

    def fmus(self, folder: Path, version: Version = 3, **capabilities: Any) -> dict[str, Path]:
        """Both as FMUs, by name; capabilities as for `test_fmus.build.linear_fmu`."""
        return {name: part.fmu(folder, version, **capabilities) for name, part in self.parts.items()}


CONVERGENT, DIVERGENT = Loop(), Loop(a=2.0, c=-1.5)
"""Loop gains -0.4 and -3."""
