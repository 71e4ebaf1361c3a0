"""Registries: the members of one kind by name, found without importing them and loaded when they are asked for.

A member is a subclass of the registry's base that states its own name, ``name = "locomotive"`` or
``check: Literal["signal"]``, in a file of one of the registry's rooms: a new file is a new member. Installed packages
bring members by entry points, and a program adds its own by assignment.
Standard library only.
"""

from __future__ import annotations

import builtins
import logging
import re
import sys
from collections.abc import Callable, Iterator, Mapping, MutableMapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast

from plant_models.explained_error import explained
from plant_models.module_loading import load_module

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint, EntryPoints

T = TypeVar("T")
LOG = logging.getLogger("plant_models")

CLASS = re.compile(
    r"^class (\w+)(?:\(([^)]*)\))?:|^    (?:name(?:: [^=\n]+)? = |check: Literal\[)((?:\"[^\"\n]+\"(?:, )?)+)"
    r"|^    def ([a-z]\w*)\(",
    re.M,
)
"""A class at the top of a file with its bases, the name that it states, and its public methods; a table states its
name, or several, in ``check``."""
IMPORT = re.compile(r"^(?: {4})?from ([\w.]+) import (?:\(([^)]*)\)|(.*))", re.M)
"""Names that a file takes from another one."""


class RegistryError(ValueError):
    """A member cannot be had: two bear its name, or what an installed package announces cannot be used."""


@cache
def log_left_out(name: str, reason: str) -> None:
    """Warn of a member that is left out, once in a process.

    Args:
        name: of the member. reason: why, in words.
    """
    LOG.warning("%r is left out: %s", name, reason)


@dataclass(frozen=True)
class Member:
    """A member that has not been loaded.

    Args:
        name: in the registry. target: ``module:Class``. origin: who brings it, for people.
        room: package of the file that holds it; empty for an installed package of others.
    """

    name: str
    target: str
    origin: str
    room: str = ""


class Registry(MutableMapping[str, T], Generic[T]):
    """Members of one kind by name.

    Iteration, ``in`` and `len` import nothing; a look-up imports the file of that member only.

    Args:
        kind: what a member is, for messages: ``plant``.
        rooms: packages whose files hold the members.
        group: of the entry points by which installed packages bring members.
        base: ``module:Class`` that members are subclasses of.
    """

    def __init__(self, kind: str, rooms: Sequence[str], group: str, base: str) -> None:
        self.kind, self.rooms, self.group, self.base = kind, tuple(rooms), group, base
        self._own: dict[str, T] = {}
        self._members: dict[str, list[Member]] | None = None

    @property
    def members(self) -> dict[str, list[Member]]:
        """What ships and what installed packages bring, by name; more than one where a name is taken twice."""
        if self._members is None:
            self._members = {}
            for member in (*self._shipped(), *self._announced()):
                self._members.setdefault(member.name, []).append(member)
        return self._members

    def room(self, name: str) -> str:
        """The package that a shipped member lives in; empty for one of an installed package or of this program, and
        for a name that is taken twice.

        Args:
            name: of the member.
        """
        found = [] if name in self._own else self.members.get(name, [])
        return found[0].room if len(found) == 1 else ""

    def own(self, name: str) -> T | None:
        """A member that this program has registered; None for others.

        Args:
            name: of the member.
        """
        return self._own.get(name)

    def targets(self, name: str) -> list[str]:
        """What a name stands for, ``module:Class``, without importing it; more than one where it is taken twice.

        Args:
            name: of a member; none for one that is unknown.
        """
        if name in self._own:
            return [f"{self._own[name].__module__}:{getattr(self._own[name], '__qualname__', '')}"]
        return [member.target for member in self.members.get(name, [])]

    def usable(self, left_out: Callable[[str, str], None] = log_left_out) -> dict[str, T]:
        """The members that can be loaded, by name.

        Args:
            left_out: is called with name and reason for each of the others.
        """
        found = {}
        for name in self:
            try:
                found[name] = self[name]
            except RegistryError as error:
                left_out(name, str(error))
        return found

    def origin(self, name: str) -> str:
        """Who brings a member, for people.

        Args:
            name: of the member.
        """
        if name in self._own or name not in self.members:
            return "registered by this program"
        return " and ".join(member.origin for member in self.members[name])

    def __getitem__(self, name: str) -> T:
        if name in self._own:
            return self._own[name]
        member, *others = self.members[name]
        if others:
            raise RegistryError(
                f"the {self.kind} name {name!r} is taken twice, by {self.origin(name)}; rename or uninstall one of "
                "them, or use file.py:Class or package.module:Class in place of the name."
            )
        loaded: T = _load(member, self.kind, self.base)
        return loaded

    def __setitem__(self, name: str, member: T) -> None:
        if not _is_member(member, self.base):
            raise RegistryError(f"the {self.kind} {name!r} is no subclass of {self.base.replace(':', '.')}.")
        _require_whole(member, f"the {self.kind} {name!r}")
        self._own[name] = member

    def __delitem__(self, name: str) -> None:
        del self._own[name]

    def __contains__(self, name: object) -> bool:
        return name in self._own or name in self.members

    def __iter__(self) -> Iterator[str]:
        yield from self.members
        yield from (name for name in self._own if name not in self.members)

    def __len__(self) -> int:
        return len({*self.members, *self._own})

    def _shipped(self) -> Iterator[Member]:
        for room in self.rooms:
            for path in _files_of(room):
                module = f"{room}.{path.stem}"
                for cls, names in _source(module).names.items():
                    target = f"{module}:{cls}"
                    meant = _descends(module, cls, self.base) or _meant(module, cls, self.base)
                    for name in names if meant else ():
                        yield Member(name, target, f"this package ({target})", room)

    def _announced(self) -> Iterator[Member]:
        for entry in announced(self.group):
            yield Member(entry.name, entry.value, f"{_package(entry)} ({entry.value})")


@dataclass(frozen=True)
class _Source:
    """What the text of a file says of its classes.

    Args:
        bases: of each class at the top of the file, as they are written. names: that a class states.
        methods: public ones of a class.
        imports: module and name by which it is known there, by the name that it has here.
    """

    bases: dict[str, tuple[str, ...]]
    names: dict[str, tuple[str, ...]]
    methods: dict[str, set[str]]
    imports: dict[str, tuple[str, str]]


@cache
def _source(module: str) -> _Source:
    """The classes of a module, read and not imported; a module without a file has none."""
    top, *parts = module.split(".")
    spec = find_spec(top)
    place = Path(next(iter((spec.submodule_search_locations if spec is not None else None) or [""])), *parts)
    path = place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
    text = path.read_text(encoding="utf-8") if path.is_file() else ""
    bases: dict[str, tuple[str, ...]] = {}
    names: dict[str, tuple[str, ...]] = {}
    methods: dict[str, set[str]] = {}
    cls = ""
    for found, listed, stated, method in CLASS.findall(text):
        if found:
            cls, bases[found] = found, tuple(re.findall(r"(?:^|, *|\n *)([\w.]+)", re.sub(r"\[[^\]]*\]", "", listed)))
        elif cls and method:
            methods.setdefault(cls, set()).add(method)
        elif cls:
            names.setdefault(cls, tuple(re.findall('"(.+?)"', stated)))
    imports = {}
    for source, many, one in IMPORT.findall(text):
        for words in (many or one).split("#")[0].split(","):
            own, _, alias = words.strip().partition(" as ")
            imports[alias or own] = (source, own)
    return _Source(bases, names, methods, imports)


@cache
def _descends(module: str, cls: str, base: str) -> bool:
    """Whether a class has a base of this name, by the text of the files on the way."""
    if f"{module}:{cls}" == base:
        return True
    source = _source(module)
    if cls in source.bases:
        return any(_descends(module, one.rpartition(".")[2], base) for one in source.bases[cls])
    return cls in source.imports and _descends(*source.imports[cls], base)


@cache
def _meant(module: str, cls: str, base: str) -> bool:
    """Whether a class that states a name and has no base of this name is meant as a member all the same, so that its
    look-up says what is wrong: it has a base that nobody defines, or a method of the base.
    """
    source, (home, _, root) = _source(module), base.partition(":")
    unknown = [b for b in source.bases[cls] if not (b in source.bases or b in source.imports or hasattr(builtins, b))]
    methods = _source(home).methods.get(root, set()) & source.methods.get(cls, set())
    return bool(methods) or any("." not in name for name in unknown)


def announced(group: str) -> EntryPoints:
    """The entry points of installed packages that belong to a group.

    Args:
        group: its name.
    """
    return _all_announced(tuple(sys.path)).select(group=group)


@cache
def _all_announced(_: tuple[str, ...]) -> EntryPoints:
    """Read once for the folders that modules come from, and not for each registry."""
    from importlib.metadata import entry_points  # noqa: PLC0415 - reads e-mails, and costs as much as all the rest

    found: Any = entry_points()  # the type hints speak of Python 3.9
    return cast("EntryPoints", found)


@cache
def _files_of(room: str) -> tuple[Path, ...]:
    """The files of a package, without those of packages in it, in the order of their names."""
    spec = find_spec(room)
    folders = (spec.submodule_search_locations if spec is not None else None) or ()
    return tuple(path for folder in folders for path in sorted(Path(folder).glob("*.py")) if path.stem != "__init__")


def lazy_names(room: str) -> Callable[[str], Any]:
    """A ``__getattr__`` for a package whose names are those at the top of its files: a file is imported when one of its
    names is asked for.

    Args:
        room: name of the package.
    """

    def get(name: str) -> Any:
        files = _files_of(room)
        if not name.startswith("_") and name not in {path.stem for path in files}:  # that is a module, not in one
            definition = re.compile(rf"^(?:(?:class |def ){name}\b|(?:\w+, )*{name}\b[^.\n(]*=)", re.MULTILINE)
            for path in files:
                if definition.search(path.read_text(encoding="utf-8")):
                    return getattr(load_module(f"{room}.{path.stem}"), name)
        raise AttributeError(f"module {room!r} has no attribute {name!r}")

    return get


def lazy_imports(room: str, homes: Mapping[str, str]) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """A ``__getattr__`` for a package that offers names of other modules, one of which is imported when a name is asked
    for; and a ``__dir__``, for completion, that lists what the package offers.

    Args:
        room: name of the package. homes: module of each name.
    """

    def get(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {room!r} has no attribute {name!r}")
        found = getattr(load_module(homes[name]), name)
        setattr(sys.modules[room], name, found)
        return found

    def offered() -> list[str]:
        return sorted(sys.modules[room].__all__)

    return get, offered


def load(target: str) -> Any:
    """What ``package.module:name`` stands for.

    Args:
        target: module and name.

    Raises:
        ImportError, AttributeError: there is no such module, or no such name in it.
    """
    module, _, name = target.partition(":")
    found: Any = load_module(module)
    for part in name.split("."):
        found = getattr(found, part)
    return found


def descends_from(found: Any, base: str) -> bool:
    """Whether a class, or an object's class, has a base of this name; that module is not imported for it.

    Args:
        found: a class or an object. base: ``module:Class``.
    """
    cls = found if isinstance(found, type) else type(found)
    return any(f"{parent.__module__}:{parent.__qualname__}" == base for parent in cls.__mro__)


def unwritten(found: Any) -> str:
    """What an abstract class leaves to be written, in words; empty for any other one.

    Args:
        found: a class.
    """
    return ", ".join(f"{name}()" for name in sorted(getattr(found, "__abstractmethods__", ())))


def _require_whole(found: Any, what: str) -> None:
    if unwritten(found):
        raise RegistryError(f"{what} is not complete: {found.__qualname__} has no {unwritten(found)}; write it.")


def _load(member: Member, kind: str, base: str) -> Any:
    what = f"the {kind} {member.name!r} of {member.origin}"
    try:
        found = load(member.target)
    except (Exception, SystemExit) as error:  # whatever the code of others, or a file being written, raises on its way
        raise RegistryError(f"{what} cannot be loaded: {explained(error)}") from error
    if not _is_member(found, base):
        raise RegistryError(f"{what} is no subclass of {base.replace(':', '.')}{_its_bases(found, base)}.")
    _require_whole(found, what)
    return found


def _its_bases(found: Any, base: str) -> str:
    """Bases of a class that has others than the one expected, and how to write it; empty for what is no class."""
    if not isinstance(found, type):
        return ""
    named = ", ".join(b.__name__ for b in found.__bases__ if b is not object) or "none"
    return f": its bases are {named}; write class {found.__name__}({base.rpartition(':')[2]})"


def _is_member(found: Any, base: str) -> bool:
    return isinstance(found, type) and descends_from(found, base)


def _package(entry: EntryPoint) -> str:
    return f"the package {entry.dist.name} {entry.dist.version}" if entry.dist is not None else "an installed package"
