"""What a check of an FMU is: a name, what it does, and what it means where it fails.

What a failure means follows from what becomes of a run of this package's master: NOTE, where no master of this package
does such a thing; LIMIT, where a run is right as long as the advice is followed; DISTRUST, where a plain run may be
wrong or may not come to its end. A crash is never less than a limit.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar

from fmus.check.context import Context
from fmus.check.findings import CheckFinding, CheckOutcome, Verdict, skipped
from fmus.fmi.standard import CO_SIMULATION

NOTE, LIMIT, DISTRUST = Verdict.NOTE, Verdict.LIMIT, Verdict.DISTRUST

REPEATED, END = "repeated run", "terminate and free"
ONE_INSTANCE = "have one instance of it in a process, a fresh process for each run"
_NO_PROBE = (
    "with balises on it, choose the method early-return or interpolate: the probe for the others would crash too"
)
SLOW = "it hangs or is slow there: a longer --timeout shows which"
MISSING = "do not use the capabilities whose functions are missing"
NO_REDOING = "do not redo steps: the master finds crossings by shorter steps or interpolation, and iterates nothing"
FIXED_STEP = "keep to one communication step; an event inside it can only be interpolated"
VARIABLE_STEP, STATES = ("canHandleVariableCommunicationStepSize",), ("canGetAndSetFMUstate",)
BYTES, DERIVATIVES = ("canSerializeFMUstate", *STATES), ("providesDirectionalDerivative",)
"""Capabilities that checks need."""

NO_BYTES = "do not store its states or take them to another instance"


class Check(ABC):
    """A check. A class of it in a file of `fmus.check.checks` is made of each FMU.

    It states its `name`, as it is reported, and the rest as keywords: ``class OutputsCheck(Check, failing=NOTE)``.

    Args:
        failing: what a failure means. advice: what to do then.
        basis: where it is distrusted, the FMU cannot be run at all and the rest is skipped.
        compares: compares two runs, which says nothing where equal runs differ anyway.
        declares: capabilities, as fmpy calls them, without which it is skipped. several: it needs several instances
            in one process. interface: that it is about. place: when it is made, from small to large.
    """

    name: ClassVar[str]
    failing: ClassVar[Verdict]
    advice: ClassVar[str] = ""
    basis: ClassVar[bool] = False
    compares: ClassVar[bool] = False
    declares: ClassVar[tuple[str, ...]] = ()
    several: ClassVar[bool] = False
    interface: ClassVar[str] = CO_SIMULATION
    place: ClassVar[float] = 100.0

    def __init_subclass__(cls, **stated: Any) -> None:
        super().__init_subclass__()
        for name, value in stated.items():
            if name not in Check.__annotations__:
                raise TypeError(f"{cls.__name__}: a check has no {name!r}; it has {', '.join(Check.__annotations__)}.")
            setattr(cls, name, value)

    @classmethod
    @abstractmethod
    def run(cls, context: Context) -> CheckOutcome:
        """Make it.

        Args:
            context: the FMU, and what was seen of it so far.

        Raises:
            SlaveError: the FMU refuses or throws, which is a failure.
        """

    @classmethod
    def outcome(cls, context: Context) -> CheckOutcome:
        """What `run` says, where the FMU declares what it needs.

        Args:
            context: the FMU, and what was seen of it so far.
        """
        if cls.several and context.only_once:
            return skipped("declares canBeInstantiatedOnlyOncePerProcess")
        for capability in cls.declares:
            if not getattr(getattr(context.description, cls.interface), capability):
                return skipped(f"does not declare {capability}")
        return cls.run(context)

    @classmethod
    def finding(cls, outcome: CheckOutcome) -> CheckFinding:
        """The finding of an outcome."""
        verdict = outcome.verdict or cls.failing
        advice = outcome.advice or cls.advice
        return CheckFinding(cls.name, verdict, outcome.detail, advice if verdict.rank >= Verdict.ERROR.rank else "")

    @classmethod
    def lost(cls, detail: str, *, crashed: bool) -> CheckFinding:
        """The finding where the process ended or fell silent in this check.

        Args:
            detail: how the process ended, in words.
            crashed: whether it ended by itself, and not by the time limit.
        """
        verdict = LIMIT if crashed and cls.failing is NOTE else cls.failing
        advice = f"{cls.advice}; {_NO_PROBE}" if crashed and cls.advice else cls.advice if crashed else SLOW
        return CheckFinding(cls.name, verdict, detail, advice)
