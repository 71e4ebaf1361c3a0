"""What the two FMI interfaces share: identity, folder, refused calls, prepared calls, saved states and the life cycle.

fmpy's tools recognise an FMU by its class, so the interfaces subclass fmpy's slaves and replace every call; no library
is loaded.
"""

from __future__ import annotations

import shutil
import tempfile
import weakref
from collections.abc import Callable, Sequence
from functools import wraps
from pathlib import Path
from typing import Any, ClassVar, Concatenate, Literal, ParamSpec, TypeVar

import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.model_description import ModelDescription

from fmu_observer.block.block_derivatives import BlockSensitivity
from fmu_observer.block.block_instance import BlockInstance
from fmu_observer.block.block_state import BlockState, deserialize, serialize
from fmu_observer.block.block_variables import ALIVE, BlockError, Mode, Role, StepDiscarded
from fmu_observer.block.policy import Counters
from fmu_observer.description import describe
from fmu_observer.event_protocol import DEFAULT_REPLAY_HORIZON, Announcement, EventProtocol, LatePolicy
from plant_models.hybrid import HybridSystem

FMI_WARNING, FMI_DISCARD, FMI_ERROR = 1, 2, 3
WARNINGS = b"logStatusWarning"  # the category in which an exported FMU says the same

P = ParamSpec("P")
R = TypeVar("R")


class BlockCallError(FMICallException, BlockError):
    """A refused call, with fmpy's exception type and a message that says why.

    Args:
        function: the call.
        reason: on which block, when, why.
        status: of FMI: an error, or a discarded step.
    """

    def __init__(self, function: str, reason: str, status: int = FMI_ERROR) -> None:
        FMICallException.__init__(self, function, status)
        self.reason = reason
        self.args = (f"{function}: {reason}",)

    def __reduce__(self) -> tuple[type[BlockCallError], tuple[str, str, int]]:
        return type(self), (self.function, self.reason, self.status)


Call = Callable[Concatenate[Any, P], R]


def allowed_in(*modes: Mode) -> Callable[[Call[P, R]], Call[P, R]]:
    """Refuse a call of the interface in any other mode than these, and turn its `BlockError` into fmpy's exception,
    with the name of the call, of the block, and the time.

    Args:
        modes: none for any.
    """

    def decorate(function: Call[P, R]) -> Call[P, R]:
        """The call of this function."""

        @wraps(function)
        def call(self: Any, /, *args: P.args, **kwargs: P.kwargs) -> R:
            try:
                if modes and self.instance.mode not in modes:
                    self.instance.require(*modes)
                return function(self, *args, **kwargs)
            except BlockCallError:
                raise
            except BlockError as error:
                raise self.refusal(function.__name__, error) from error.__cause__

        return call

    return decorate


refused = allowed_in()
"""The same in any mode."""


class FMIInterface:
    """State and life cycle common to the FMI 2 and the FMI 3 interface of a block.

    A new block is in the mode *instantiated*; `instantiate` makes a used one new again. Calls that the standard does
    not allow in a mode are refused with a `BlockCallError`, as the exported FMU refuses them.

    Args:
        system: the hybrid system to present.
        preset: preset whose values are the start values.
        instance_name: name, in messages; its noise follows from it where no seed is given; the system's by default.
        late_policy: what to do with events stamped in the past: ``replay``, ``reject`` or ``late``; the start value of
            the parameter of that name. None for what the system declares.
        replay_horizon: how far back ``replay`` can go [s]; the start value of the parameter of that name.
        announcement: how events are announced, ``clocks`` (FMI 3 only) or ``counts``; None for what is usual in the
            version.

    Raises:
        ValueError: the preset, the policy or the announcement is unknown, or the horizon is not a time.
    """

    fmi_version: ClassVar[Literal[2, 3]]
    real_type: ClassVar[str]

    def __init__(
        self,
        system: HybridSystem,
        *,
        preset: str | None = None,
        instance_name: str | None = None,
        late_policy: LatePolicy | None = None,
        replay_horizon: float = DEFAULT_REPLAY_HORIZON,
        announcement: Announcement | None = None,
    ) -> None:
        self.system = system
        try:
            protocol = EventProtocol(announcement, late_policy, replay_horizon)
            counts_events = protocol.counts(self.fmi_version)
        except ValueError as error:
            raise BlockError(f"{system.name}: {error}") from error
        self.model_description: ModelDescription = describe(system, self.fmi_version, preset=preset, protocol=protocol)
        self.modelDescription = self.model_description
        self.guid: str = self.model_description.instantiationToken
        self.instanceName = instance_name or system.name
        self.modelIdentifier = system.name
        self.instance = BlockInstance(system, self.guid, counts_events, protocol, preset, self.instanceName)
        self.counters: Counters = self.instance.events.counters
        """What became of the events so far."""
        self._counts_events = counts_events
        self._sensitivity = BlockSensitivity(system, self.model_description.modelVariables)
        self._folder: str | None = None

    # -- identity ---------------------------------------------------------------------------------------------------

    @property
    def mode(self) -> Mode:
        """Mode of the life cycle."""
        return self.instance.mode

    @property
    def component(self) -> FMIInterface:
        """What fmpy hands back to the low-level calls."""
        return self

    @property
    def unzipDirectory(self) -> str:
        """A folder to hand to fmpy where it insists on a file name; it holds an empty modelDescription.xml."""
        if self._folder is None:
            self._folder = tempfile.mkdtemp(prefix=f"{self.system.name}_")
            weakref.finalize(self, shutil.rmtree, self._folder, ignore_errors=True)
            (Path(self._folder) / "modelDescription.xml").touch()
        return self._folder

    def getVersion(self) -> str:
        """Version of FMI."""
        return f"{self.fmi_version}.0"

    def setDebugLogging(self, loggingOn: bool, categories: Sequence[str]) -> None:
        """Nothing to switch: what is wrong is raised, or logged by Python's `logging`.

        Args:
            loggingOn: whether the importer wants log messages. categories: of the log.
        """

    # -- life -------------------------------------------------------------------------------------------------------

    @allowed_in("initialization")
    def exitInitializationMode(self) -> None:
        """End initialisation; time begins to run."""
        self.instance.start()
        self.instance.mode = self._mode_after_initialization()

    @allowed_in("step", "event")
    def terminate(self) -> None:
        """End the run; values can still be read."""
        self.instance.mode = "terminated"

    @allowed_in(*ALIVE)
    def reset(self) -> None:
        """Back to the state after instantiation."""
        self.instance.reset()

    def freeInstance(self) -> None:
        """End of life; only `instantiate` brings the block back."""
        self.instance.mode = "freed"

    def freeLibrary(self) -> None:
        """Nothing to free: there is no library."""

    # -- values -----------------------------------------------------------------------------------------------------

    @refused
    def prepared_get(self, references: Sequence[int], values: np.ndarray) -> Callable[[], None]:
        """A call without arguments that reads real variables into `values`, shape (len(references),).

        It does what `getReal` / `getFloat64` does; quick where all are outputs.
        """
        if self._all_have_role("output", references, values):
            return self.instance.output_reader(references, values)
        get = getattr(self, f"get{self.real_type}")

        def read() -> None:
            values[:] = get(references)

        return read

    @refused
    def prepared_set(self, references: Sequence[int], values: np.ndarray) -> Callable[[], None]:
        """A call without arguments that sets real variables from `values`, shape (len(references),).

        It does what `setReal` / `setFloat64` does; quick where all are inputs (but not payload), the mode is not
        checked then.
        """
        if self._all_have_role("input", references, values):
            return self.instance.input_writer(references, values)
        set_values = getattr(self, f"set{self.real_type}")
        return lambda: set_values(references, values.tolist())

    def directional_derivative(
        self, unknowns: Sequence[int], knowns: Sequence[int], seed: Sequence[float]
    ) -> list[float]:
        """Exact directional derivatives of real outputs and derivatives, see `BlockSensitivity.directional`.

        Args:
            unknowns: value references of outputs or derivatives. knowns: value references of inputs or states.
            seed: direction, one number for each known.
        """
        self.instance.require(*ALIVE)
        if self.mode == "instantiated":
            raise BlockError("directional derivatives are there from initialization mode on.")
        return self._sensitivity.directional(self.instance.runtime, unknowns, knowns, seed)

    # -- saved states -----------------------------------------------------------------------------------------------

    def getFMUState(self) -> BlockState:
        """The whole state, mode and pending events included, as a value."""
        try:
            return self.instance.save()
        except BlockError as error:
            raise self.refusal("getFMUState", error) from error.__cause__

    def setFMUState(self, state: BlockState) -> None:
        """Return to a state taken by `getFMUState`, exactly and as often as wanted."""
        try:
            self.instance.load(state)
        except BlockError as error:
            raise self.refusal("setFMUState", error) from error.__cause__

    def freeFMUState(self, state: BlockState) -> None:
        """Nothing to free: states are Python values.

        Args:
            state: as `getFMUState` or `getFMUstate` gave it.
        """

    def serializeFMUState(self, state: BlockState) -> bytes:
        """A state as bytes, to be read by any block of the same model, also in another process."""
        return serialize(state)

    @refused
    def deserializeFMUState(self, serializedState: bytes, state: BlockState | None = None) -> BlockState:
        """The state that `serializeFMUState` wrote.

        Args:
            serializedState: bytes.
        """
        return self.instance.check(deserialize(serializedState, self.instance.shape))

    # -- internals --------------------------------------------------------------------------------------------------

    def refusal(self, function: str, reason: object) -> BlockCallError:
        """The exception for a refused call: it names the call, the block and the time.

        Args:
            function: name of the call. reason: what was wrong, in words.
        """
        status = FMI_DISCARD if isinstance(reason, StepDiscarded) else FMI_ERROR
        when = round(float(self.instance.runtime.t), 9)
        return BlockCallError(function, f"{self.instanceName} at t = {when!r} s: {reason}", status)

    def _mode_after_initialization(self) -> Mode:
        return "step"

    def _all_have_role(self, role: Role, references: Sequence[int], values: np.ndarray) -> bool:
        if values.shape != (len(references),):
            raise BlockError(f"the array has shape {values.shape}, expected ({len(references)},).")
        return self.instance.variables.have_role(references, role)

    def _call(self, function: str, *_: Any) -> Any:
        """Every low-level call of fmpy that is not replaced ends here."""
        raise self.refusal(function, "not supported: the model has no such variables or capabilities.")
