"""Libraries of shipped FMUs that stay loaded from one run to the next, so that a study loads them once.

Only FMUs that this package built itself: their libraries keep nothing outside their instances, so an instance made in a
library that was used before computes what one made in a fresh library computes. An FMU by path is loaded anew for
every run.
"""

from __future__ import annotations

import atexit
from collections import OrderedDict
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass
from pathlib import Path

from cosim.components.component import Component
from cosim.components.loading import COMPONENTS, load_fmu
from fmus.fmi.standard import fmi_version

MOST = 96
"""Libraries kept at a time in a process, more than there are observers in a choice; the one that was not used for the
longest time makes way.
"""


@dataclass
class _Kept:
    """A loaded library.

    Args:
        component: whose slave has loaded it and is never instantiated. release: removes its files.
        used: components over it that are not freed yet.
    """

    component: Component
    release: Callable[[], None] | None
    used: int = 0

    def give_back(self) -> None:
        self.used -= 1

    def let_go(self) -> None:
        slave = self.component.slave
        type(slave).freeLibrary(slave)
        if self.release is not None:
            self.release()


_kept: OrderedDict[tuple[Path, str], _Kept] = OrderedDict()


def load_shipped(path: Path, name: str) -> Component:
    """`load_fmu` for an FMU that this package built itself; unpacked and loaded once in a process.

    Args:
        path: of the FMU in the cache, which holds one content for ever. name: of the component.

    Returns:
        A component of its own, not yet instantiated, over the library that is kept.

    Raises:
        FmuLoadError: as for `load_fmu`.
    """
    known = _kept.get((path, name)) or _keep(path, name)
    _kept.move_to_end((path, name))
    known.used += 1
    pattern = known.component
    slave = copy(pattern.slave)
    slave._functions = dict(slave._functions)  # who answers in place of a function does so for one instance
    component: Component = COMPONENTS[fmi_version(pattern.description)](
        name,
        slave,
        pattern.description,
        source=pattern.source,
        kind=pattern.kind,
        release_files=known.give_back,
    )
    component.choose_tolerance(None)
    return component


def _keep(path: Path, name: str) -> _Kept:
    idle = [key for key, kept in _kept.items() if kept.used == 0]
    for key in idle[: max(0, len(_kept) + 1 - MOST)]:
        _kept.pop(key).let_go()
    component = load_fmu(path, name)
    component.slave.freeLibrary = _stays
    known = _kept[path, name] = _Kept(component, component.take_files())
    return known


def _stays() -> None:
    """In place of fmpy's `freeLibrary`, which every `freeInstance` calls."""


@atexit.register
def _let_all_go() -> None:
    while _kept:
        _kept.popitem()[1].let_go()
