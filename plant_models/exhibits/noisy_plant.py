"""Base of benchmark plants with process noise and sampled, noisy measurements. Knows only the hybrid foundation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from plant_models.hybrid import Array, HybridSystem, PeriodicEvent, Signal, memory, parameter, standard_normal, vector


class NoisyPlant(HybridSystem):
    """Base of plants ``x(k+1) = F(x(k), u(k)) + w(k)``, ``y(k) = h(x(k)) + v(k)`` whose F is the flow over a period.

    A subclass sets `moving` (continuous states) and `plain_outputs`, writes `flow`, `measured` and `plain`, and calls
    `declare` before ``super().__init__``. At each sampling instant the states jump by ``process_noise`` times standard
    normal numbers, and what is measured then is held with ``measurement_noise`` added. Both are zero unless set, so
    that the plant is the plain differential equation.
    """

    moving: tuple[Signal, ...] = ()
    plain_outputs: tuple[Signal, ...] = ()

    def measured(self, x: Any, p: Any) -> tuple[Array, ...]:
        """What is measured without noise, one scalar a measurement."""
        raise NotImplementedError

    def plain(self, x: Any, p: Any) -> dict[str, Array]:
        """Values of `plain_outputs` by name."""
        raise NotImplementedError

    def declare(self, measurements: Sequence[Signal], parameters: Sequence[Signal], period: float) -> None:
        """Set states, outputs, parameters and the sampling event.

        Args:
            measurements: outputs ``measured_<y>``. parameters: of the equations. period: between two samples [s].
        """
        n, q = len(self.moving), len(measurements)
        held = tuple(memory(f"held_{s.name}", s.unit, 0.0, f"{s.description}, held") for s in measurements)
        self.states = (*self.moving, *held)
        self.outputs = (*self.plain_outputs, *measurements)
        self.parameters = (
            *parameters,
            parameter("sample_period", "s", period, "Time between two samples", min=1e-6),
            parameter(
                "process_noise",
                "1",
                0.0,
                "Standard deviation of what is added to each state at a sample, in its unit",
                min=0.0,
                size=n,
            ),
            parameter(
                "measurement_noise",
                "1",
                0.0,
                "Standard deviation of the noise of each measurement, in its unit",
                min=0.0,
                size=q,
            ),
        )
        noises = (
            standard_normal("process_normal", "Standard normal numbers", size=n),
            standard_normal("measurement_normal", "Standard normal numbers", size=q),
        )
        self.events = (PeriodicEvent("sampling", "sample_period", noises=noises, description="A sample is taken"),)

    def named(self, values: Array) -> Any:
        """Named tuple of the moving states alone.

        Args:
            values: shape (n,) or (n, ...).
        """
        return self._flowing_places.named(values)

    def rates(self, values: Array, p: Any, u: Any = None) -> Array:
        """Derivatives of the moving states, of the shape of `values`: the plant as a model.

        Args:
            values: moving states, shape (n,) or (n, ...). p: parameters of the equations. u: inputs that they need.
        """
        return vector(*self.flow(0.0, self.named(values), u, p).values())

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Disturb the states, then measure."""
        moved = {
            s.name: getattr(x, s.name) + p.process_noise[i] * u.process_normal[i] for i, s in enumerate(self.moving)
        }
        seen = self.measured(x._replace(**moved), p)
        held = {
            f"held_{s.name}": y + p.measurement_noise[j] * u.measurement_normal[j]
            for j, (s, y) in enumerate(zip(self.outputs[len(self.plain_outputs) :], seen, strict=True))
        }
        return moved | held

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        held = {s.name: getattr(x, f"held_{s.name}") for s in self.outputs[len(self.plain_outputs) :]}
        return self.plain(x, p) | held


def solved_2(matrix: tuple[Array, Array, Array], right: tuple[Array, Array]) -> tuple[Array, Array]:
    """Solution of a symmetric linear system of two equations.

    Args:
        matrix: entries 11, 12, 22. right: right-hand side. Scalars or arrays of shape (members,).
    """
    a, b, c = matrix
    determinant = a * c - b * b
    return (c * right[0] - b * right[1]) / determinant, (a * right[1] - b * right[0]) / determinant
