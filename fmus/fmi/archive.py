"""Archives: an FMU file is examined before anything of it is unpacked, and refused where it is broken, dangerous or
foreign.
"""

from __future__ import annotations

import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory

from fmpy import read_model_description
from fmpy.model_description import BuildConfiguration, ModelDescription, ValidationError

from fmus.fmi.binaries import platform_folder, platforms_with, why_not_here
from fmus.fmi.description import FILE, read_description
from fmus.fmi.sense import distinguish, nonsense
from fmus.fmi.sources import add_compiled, build_configurations, compiled_here, how_to_compile
from fmus.fmi.standard import INTERFACES
from fmus.near_files import missing_file, what_it_is
from plant_models.left_behind import owned

MAX_UNPACKED_BYTES = 2 * 1024**3
MAX_FILES = 100_000
MAX_DESCRIPTION_BYTES = 256 * 1024**2
ENCRYPTED = 1


class NotAnFmuError(ValueError):
    """A file is not an FMU, or one that cannot be run here; the message says what was expected."""


@dataclass(frozen=True)
class Archive:
    """An FMU file that may be unpacked.

    Args:
        path: the file.
        description: its model description.
        names: of the files in it.
    """

    path: Path
    description: ModelDescription
    names: tuple[str, ...]

    @property
    def interfaces(self) -> list[str]:
        """Interface types it offers, as fmpy calls them."""
        return [name for name in INTERFACES if getattr(self.description, name) is not None]

    @property
    def platforms(self) -> tuple[str, ...]:
        """Platforms it has a library for, as the folders in ``binaries/`` are named."""
        return platforms_with(self._identifiers(*self.interfaces), self.names)

    @property
    def here(self) -> list[str]:
        """Those of its platforms that are this one."""
        return [name for name in self.platforms if name == platform_folder(self.description)]

    def why_not_here(self, *interfaces: str) -> str:
        """Why its library cannot be run on this machine, in words that go on after its name; empty where it can.

        Args:
            interfaces: types of which the library must offer one, by default all that are declared.
        """
        wanted = self._identifiers(*(interfaces or self.interfaces))
        reason = why_not_here(self.description, wanted, self.names)
        if not reason or self.compiled_here(*interfaces):
            return ""
        return reason + how_to_compile(self.path, self.build_configurations(*interfaces))

    def compiled_here(self, *interfaces: str) -> list[Path]:
        """Libraries compiled of its sources on this machine; arguments as for `why_not_here`.

        Args:
            interfaces: in the words of fmpy.
        """
        return compiled_here(self.path, self._identifiers(*(interfaces or self.interfaces)))

    def build_configurations(self, *interfaces: str) -> list[BuildConfiguration]:
        """What its libraries are compiled of; arguments as for `why_not_here`.

        Args:
            interfaces: in the words of fmpy.
        """
        wanted = self._identifiers(*(interfaces or self.interfaces))
        return build_configurations(self.description, wanted, self.names)

    def add_compiled(self, folder: Path) -> None:
        """Put the libraries compiled of its sources on this machine where it lacks them.

        Args:
            folder: where it is unpacked.

        Raises:
            OSError: a file cannot be written.
        """
        add_compiled(self.path, self._identifiers(*self.interfaces), self.description, folder)

    def demand_this_platform(self, *interfaces: str) -> None:
        """Refuse an FMU without a library for this platform; arguments as for `why_not_here`.

        Args:
            interfaces: interface types, in the words of fmpy.

        Raises:
            NotAnFmuError: there is none; the message says what there is and what was needed.
        """
        reason = self.why_not_here(*interfaces)
        if reason:
            raise NotAnFmuError(f"{self.path} {reason}")

    def _identifiers(self, *interfaces: str) -> set[str]:
        return {getattr(self.description, name).modelIdentifier for name in interfaces}

    @contextmanager
    def unpacked(self) -> Iterator[Path]:
        """The folder with its content, removed at the end.

        Raises:
            NotAnFmuError: the archive is corrupt.
        """
        with TemporaryDirectory(prefix=owned("fmus-check-"), ignore_cleanup_errors=True) as name:
            try:
                with zipfile.ZipFile(self.path) as archive:
                    archive.extractall(name)
            except Exception as error:  # each compression throws its own: zlib.error, lzma.LZMAError
                raise NotAnFmuError(f"{self.path} is a corrupt archive: {error or type(error).__name__}") from error
            self.add_compiled(Path(name))
            yield Path(name)


def open_archive(path: Path, max_bytes: int = MAX_UNPACKED_BYTES, versions: Sequence[str] = ("2.0", "3.0")) -> Archive:
    """Examine an FMU file; nothing is unpacked.

    Args:
        path: the file.
        max_bytes: refuse what declares to unpack to more.
        versions: FMI versions that the caller can run.

    Raises:
        NotAnFmuError: it is missing, broken, dangerous, no FMU, or of an FMI version that is not known here.
    """
    if not path.is_file():
        if path.is_dir():
            raise NotAnFmuError(f"{path} is {what_it_is(path)}; expected an .fmu file.")
        raise NotAnFmuError(f"FMU {missing_file(path, '.fmu')}")
    try:
        with zipfile.ZipFile(path) as archive:
            entries = archive.infolist()
    except (zipfile.BadZipFile, OSError, EOFError, ValueError, NotImplementedError) as error:
        if path.suffix.lower() != ".fmu" and (kind := what_it_is(path)):
            raise NotAnFmuError(f"{path} is {kind}; expected an .fmu file.") from error
        raise NotAnFmuError(f"{path} is not a readable FMU: not a zip archive, or a broken one ({error}).") from error
    demand_harmless(path, entries, max_bytes)
    description = _description(path, [entry.filename for entry in entries], versions)
    return Archive(path, description, tuple(entry.filename for entry in entries))


def demand_harmless(path: Path, entries: list[zipfile.ZipInfo], max_bytes: int = MAX_UNPACKED_BYTES) -> None:
    """Refuse an archive that would unpack to too much, or to places outside of its own folder; by its entries alone.

    Args:
        path: of the FMU.
        max_bytes: what the archive may unpack to [bytes].

    Raises:
        NotAnFmuError: it is refused.
    """
    size = sum(entry.file_size for entry in entries)
    if size > max_bytes or len(entries) > MAX_FILES:
        limit = f"{max_bytes / 1e9:.1f} GB and {MAX_FILES} files"
        raise NotAnFmuError(
            f"{path} would unpack to {size / 1e9:.1f} GB; refused: {len(entries)} files, the limit is {limit}."
        )
    for entry in entries:
        name = entry.orig_filename
        if name.startswith("/") or ":" in name or "\\" in name or ".." in PurePosixPath(name).parts or "\0" in name:
            raise NotAnFmuError(f"{path} holds a file named {name!r}, which leads outside of the archive; refused.")
        if entry.flag_bits & ENCRYPTED:
            raise NotAnFmuError(f"{path} holds the encrypted file {name!r}; an FMU must not be encrypted.")
        if name == FILE and entry.file_size > MAX_DESCRIPTION_BYTES:
            raise NotAnFmuError(f"{path} has a modelDescription.xml of {entry.file_size / 1e9:.1f} GB; refused.")


def _description(path: Path, names: list[str], versions: Sequence[str]) -> ModelDescription:
    if FILE not in names:
        raise NotAnFmuError(f"{path} is not a readable FMU: it has no modelDescription.xml.")
    try:
        description = read_description(path)
    except Exception as error:  # whatever a broken file makes the parser throw
        reason = _why_unreadable(path, error)
        raise NotAnFmuError(
            f"{path} is not a readable FMU: modelDescription.xml cannot be parsed ({reason})."
        ) from error
    version = str(description.fmiVersion)
    if not version.startswith(tuple(known[:2] for known in versions)):
        supported = f"{', '.join(versions[:-1])} and {versions[-1]}"
        raise NotAnFmuError(f"{path} is FMI {version}; FMI {supported} are supported.")
    if all(getattr(description, name) is None for name in INTERFACES):
        raise NotAnFmuError(f"{path} offers no interface: neither {', '.join(INTERFACES.values())}.")
    distinguish(description)
    fault = nonsense(description)
    if fault is not None:
        raise NotAnFmuError(f"{path} cannot be used: modelDescription.xml: {fault}")
    return description


def _why_unreadable(source: Path, error: Exception) -> str:
    """Why a model description could not be read: what the schema of the standard says first, else what the parser
    threw.

    Args:
        source: the user's file.
        error: what the parser threw.
    """
    try:
        read_model_description(str(source), validate=True)
    except ValidationError as found:
        lines = [line.removeprefix("- ") for line in str(found).splitlines() if line.startswith("- ")]
        return lines[0].rstrip(".") if lines else str(error)
    except Exception:  # as before, with nothing learnt from the schema
        pass
    if isinstance(error, (KeyError, TypeError, AttributeError)):  # of the parser, on its way through the entries
        return f"an attribute is missing, or a reference leads nowhere: {type(error).__name__} {error}"
    return str(error)
