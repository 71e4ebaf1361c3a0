"""O6: the implicit discrete filtering differentiator as a system. The equations are in `implicit_recursion`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from fmu_observer.formulas.differentiation.implicit_recursion import implicit_step
from fmu_observer.models.observer_model import named_as, stacked_of
from fmu_observer.observers.generic.differentiators.signal_differentiator import LARGEST, SignalDifferentiator
from fmu_observer.observers.generic.discrete.sample_step import at_sample, initialised_memory
from plant_models.hybrid import Array, PeriodicEvent, memory, parameter
from plant_models.hybrid.missing import or_else
from plant_models.hybrid.option import require_whole


class ImplicitDifferentiator(SignalDifferentiator):
    """Implicit discretisation of the filtering differentiator: Bouchama 2024, (1.36), Theorem 5.

    The sign is taken at the end of the step, from an equation that is solved exactly. What is left is a limit cycle of
    the order of ``L tau^(n+1-i)``, because z_0 - f is held over the step; for n = 1 less than half of that of an
    explicit step. Repaired:
    in the case ``b < -a_0`` of Theorem 5, xi = +1 and ``w_1 = +r^(m+1)``. The root is found by a fixed number of Newton
    steps that are safe and enough for rounding accuracy.

    At a sample the step from the last one is taken with the signal read there; the estimates published then belong to
    this sample. A sample that is missing (NaN) drives nothing.

    Args:
        order: n. filtering_order: nf, at least 1; n + nf at most 5. unit: unit of the signal.
    """

    name = "implicit_differentiator"
    description = "Implicit discrete filtering differentiator of a sampled signal"
    source = "Bouchama 2024, (1.36), Theorem 5, third case repaired"
    discrete = True
    option_choices: ClassVar[Mapping[str, Sequence[Any]]] = {
        "order": (0, 1, 2),
        "filtering_order": tuple(range(1, LARGEST)),
    }

    def __init__(self, order: int = 1, filtering_order: int = 3, unit: str = "1") -> None:
        require_whole(self.name, 0, filtering_order=filtering_order)
        if filtering_order < 1:
            raise ValueError(f"{self.name}: filtering order {filtering_order}, expected at least 1.")
        text = "The signal is read"
        self.events = (
            PeriodicEvent("sampling", "sample_period", description=text, samples=("signal",), leaves_out=True),
        )
        super().__init__(
            order,
            filtering_order,
            unit,
            extra_parameters=(parameter("sample_period", "s", 0.01, "Sampling period of the signal", min=1e-6),),
            extra_memory=initialised_memory(memory("held_signal", unit, 0.0, "Signal at the last sample")),
        )

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The step from the last sample to this one; then the signal is read."""

        def advance(x: Any) -> dict[str, Array]:
            w, z = stacked_of(x, self.filters), stacked_of(x, self.estimates)
            w_next, z_next = implicit_step(w, z, x.held_signal, p.bound, p.sample_period)
            return named_as((*self.filters, *self.estimates), (*w_next, *z_next))

        def read(x: Any) -> dict[str, Array]:  # where the signal is missing it is taken to be what is estimated
            return {"held_signal": or_else(u.signal, x.estimated_value)}

        return at_sample(x, advance, read)

    def interval(self, p: Any) -> float:
        """The sampling period [s]."""
        return float(p.sample_period)
