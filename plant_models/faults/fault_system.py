"""Systems that pass signals on, with the faults of a cause: what `signal_fault` and `wheel_fault` have in common."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from plant_models import FAULT_CAUSES
from plant_models.faults.fault_cause import Carrier, Fault, FaultCause, one_where
from plant_models.hybrid import Array, HybridSystem, OutputWarning, Signal, output_signal, vector
from plant_models.hybrid.noise import Purpose
from plant_models.hybrid.option import MemberNames, require_whole
from plant_models.user_file import Expected, load_class, make, names_code

CAUSES = MemberNames(FAULT_CAUSES)
"""What the option `cause` may be: a name, ``file.py:Class`` or ``package.module:Class``."""
_CAUSE = Expected("subclass of FaultCause", lambda c: isinstance(c, type) and issubclass(c, FaultCause))


class FaultSystem(HybridSystem):
    """Base of systems that pass signals on: each becomes ``value (1 + depth) + added``, and `cause` says what these
    are, when and why.

    What the cause declares stands behind what the system declares. Its switching functions divide steps where anything
    flows; else its edges are compared with the time.

    Args:
        carrier: what passes on. cause: its name, see `CAUSES`. options: of the system, `cause` among them.

    Raises:
        ValueError: an unknown cause, or one that does not fit, or a count of faults below one.
    """

    internal_step = 1e-2  # what flows is exact for a held input, whatever the step
    bounded_parameters = "all"
    purpose = Purpose.FAULTS

    def __init__(self, carrier: Carrier, **options: Any) -> None:
        require_whole(self.name, fault_count=carrier.fault_count)
        self.cause = cause = _made_cause(options["cause"], carrier)
        self._refuse_clashes(cause)
        self.inputs = _joined(self.inputs, cause.inputs)
        self.parameters = _joined(self.parameters, cause.parameters)
        self.states = (*self.states, *cause.states)
        self.switchings = cause.switchings if any(s.variability == "continuous" for s in self.states) else ()
        self.events = cause.events
        super().__init__(**options)

    def healthy(self, u: Any) -> Sequence[Array]:
        """The signals without their faults."""
        raise NotImplementedError(f"{type(self).__name__} does not say which signals it passes on; write healthy(u).")

    def faulty(self, t: Array, x: Any, u: Any, p: Any) -> tuple[Sequence[Array], Fault]:
        """The values on which the cause acts now, and what is wrong with them; arguments as for `output`."""
        values = self.cause.carried(x, self.healthy(u))
        fault = self.cause.fault(t, x, u, p, self.switches(t, x, u, p), values)
        return values, fault if fault.added else fault._replace(added=[0.0] * len(values))

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return self.cause.rates(t, x, u, p, self.switches(t, x, u, p))

    def switching(self, t: Array, x: Any, u: Any, p: Any) -> Array:
        edges = self.cause.switching(t, x, u, p)
        return vector(*edges) if edges else np.zeros(0)

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """What an event of the cause changes."""
        return self.cause.jump(t, x, u, p, self.healthy(u))

    def requirements(self, p: Any) -> dict[str, Array]:
        """Parameters keep their bounds, and what the cause requires."""
        return {**super().requirements(p), **self.cause.requirements(p)}

    def _refuse_clashes(self, cause: FaultCause) -> None:
        """A name of the cause that means something else in the system."""
        own = {s.name: s for s in (*self.inputs, *self.outputs, *self.parameters, *self.states)}
        for signal in (*cause.inputs, *cause.parameters, *cause.states):
            known = own.get(signal.name)
            if known is not None and (signal in cause.states or _meaning(signal) != _meaning(known)):
                raise ValueError(
                    f"The cause {cause.name!r} declares {signal.name!r} ({signal.causality}, {signal.unit}), but "
                    f"{self.name} has another {signal.name!r} ({known.causality}, {known.unit}); give it another name."
                )


def unfinished_output(faults: str) -> Signal:
    """The output that counts the faults that are not over, and warns of them at the end of a run.

    Args:
        faults: what one is called: ``fault``.
    """
    warning = OutputWarning(
        f"a {faults} is not over when the run ends: a fault_length goes beyond the end, or a fault_onset lies there; "
        "shorten the fault, or let the run go on",
        ("faults_unfinished",),
        at_end=True,
    )
    return output_signal("faults_unfinished", "1", f"Number of {faults}s that are not over yet", warning=warning)


def active(fault: Fault) -> Array:
    """1 while a fault acts, else 0 [1].

    Args:
        fault: what is wrong now.
    """
    return np.maximum(one_where(np.abs(fault.depth) > 0.0), fault.acting)


def _made_cause(name: object, carrier: Carrier) -> FaultCause:
    found: Any = None
    if isinstance(name, str):
        found = FAULT_CAUSES[name] if name in FAULT_CAUSES else load_class(name, _CAUSE) if names_code(name) else None
    if found is None:
        known = ", ".join(FAULT_CAUSES)
        raise ValueError(f"Unknown cause {name!r}; choose one of: {known}, or write file.py:Class.")
    cause: FaultCause = make(found, {"carrier": carrier})
    return cause


def _meaning(signal: Signal) -> tuple[object, ...]:
    return signal.causality, signal.unit, signal.size


def _joined(own: Sequence[Signal], others: Sequence[Signal]) -> tuple[Signal, ...]:
    known = {signal.name for signal in own}
    return (*own, *(signal for signal in others if signal.name not in known))
