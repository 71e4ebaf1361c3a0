"""Context: all that a check function needs: the unpacked FMU, how to run it, and a runner that the checks of one
process share.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TypeVar

from fmpy.model_description import ModelDescription

from fmus.check.checked_instance import FmuInstance, FmuSlave, make_slave
from fmus.check.exchange_model import FmuModel, make_model
from fmus.check.runner import Runner
from fmus.fmi.standard import MODEL_EXCHANGE
from fmus.fmi.surroundings import Surroundings, open_files

SHARE_OF_BUDGET = 0.3
"""Of the time of a check, for finding inputs that move something."""


Made = TypeVar("Made", bound=FmuInstance)
INSTANCE = "checked"
"""Name of all instances, one after the other and beside each other."""


def _unnoted(call: str) -> None:
    """Nothing is made of the name of a call.

    Args:
        call: that ends an instance.
    """


@dataclass
class Context:
    """What is checked and how.

    Args:
        folder: where the FMU was unpacked.
        description: its model description.
        step: communication step [s].
        start_time: [s].
        starts: start values by name.
        budget: time that one check may take [s]; checks that count on stop well before.
        steps: of the longest run.
        ends: whether instances are terminated and freed. announce: called with the name of each call that ends one,
            and with nothing after it.
        surroundings, directory, open_files: of the process, before anything of the FMU runs; `entries` are those of
            the directory.
    """

    folder: Path
    description: ModelDescription
    step: float
    start_time: float
    starts: Mapping[str, float]
    budget: float
    steps: int
    ends: bool = True
    announce: Callable[[str], None] = _unnoted
    surroundings: Surroundings = field(default_factory=Surroundings)
    directory: Path = field(default_factory=Path.cwd)
    open_files: Mapping[int, tuple[int, int]] = field(default_factory=open_files)

    def __post_init__(self) -> None:
        self.entries = {entry.name for entry in self.directory.iterdir()}

    def slave(self, *, logging: bool = False) -> FmuSlave:
        """A fresh co-simulation instance, not yet instantiated. All have one name: what is drawn may follow from it.

        Args:
            logging: whether the FMU is asked to log.
        """
        return self._announcing(make_slave(self.folder, self.description, INSTANCE, logging=logging))

    def model(self) -> FmuModel:
        """A fresh model exchange instance, not yet instantiated."""
        return self._announcing(make_model(self.folder, self.description, INSTANCE))

    def _announcing(self, instance: Made) -> Made:
        instance.ends, instance.announce = self.ends, self.announce
        return instance

    def instance(self, interface: str) -> FmuInstance:
        """A fresh instance of an interface type, not yet instantiated.

        Args:
            interface: ``coSimulation`` or ``modelExchange``.
        """
        return self.model() if interface == MODEL_EXCHANGE else self.slave()

    def quiet_runner(self) -> Runner:
        """A runner that has not been stepped to find an excitation; the caller puts it away."""
        if self.only_once and "runner" in self.__dict__:
            self.runner.park()
        until = self.start_time + self.steps * self.step
        runner = Runner(self.slave, self.starts, self.start_time, self.step, until=until)
        runner.patience = SHARE_OF_BUDGET * self.budget
        return runner

    @contextmanager
    def begun_runner(self) -> Iterator[Runner]:
        """A quiet runner at the start of its run, put away at the end."""
        with self.quiet_runner() as runner:
            runner.begin(excited=False)
            yield runner

    @cached_property
    def runner(self) -> Runner:
        """The shared runner, excited where some input moves the outputs."""
        runner = self.quiet_runner()
        runner.excite(SHARE_OF_BUDGET * self.budget)
        return runner

    def fresh_runner(self, starts: Mapping[str, float] | None = None) -> Runner:
        """A runner with an instance of its own, to be spoiled; the caller puts it away.

        Args:
            starts: start values by name beside those of the check.
        """
        if self.only_once:
            self.runner.park()
        return self.runner.twin(self.slave, starts)

    @property
    def only_once(self) -> bool:
        """Whether the FMU allows one instance per process only."""
        interface = self.description.coSimulation or self.description.modelExchange
        return bool(interface.canBeInstantiatedOnlyOncePerProcess)

    def close(self) -> None:
        """Free the shared runner."""
        if "runner" in self.__dict__:
            self.runner.put_away()
