"""Packages: an `.ssp` archive is looked at before anything of it is unpacked; its members are found by the URIs of the
standard.

Touches archives and a folder of its own for what is unpacked, which is removed when nothing needs it any more.
"""

from __future__ import annotations

import posixpath
import shutil
import weakref
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from tempfile import mkdtemp
from typing import IO
from urllib.parse import unquote, urlsplit

from cosim.errors import ScenarioError, nearest
from cosim.ssp.document import Node, fail
from cosim.ssp.lapses import Lapses
from fmus.fmi.archive import MAX_UNPACKED_BYTES, NotAnFmuError, demand_harmless
from fmus.near_files import missing_file
from plant_models.left_behind import owned

DEFAULT_VARIANT = "SystemStructure.ssd"
_MAX_XML_BYTES = 64 * 1024**2


class Unpacked:
    """A folder for what is unpacked, removed with the last object that holds this one."""

    def __init__(self) -> None:
        self.path = Path(mkdtemp(prefix=owned("ssp-")))
        self.remove = weakref.finalize(self, shutil.rmtree, self.path, ignore_errors=True)

    def fresh(self, name: str) -> Path:
        """A path for a file of this name that no other has."""
        folder = self.path / str(len(list(self.path.iterdir())))
        folder.mkdir()
        return folder / name


class Package:
    """An `.ssp` file.

    Args:
        path: the file.
        title: how it is called in messages.
        unpacked: where its members go when a file of them is needed.
        lapses: receives what is not as the standard wants it.

    Raises:
        ScenarioError: it is missing, no archive, dangerous, or has no ``SystemStructure.ssd``.
    """

    def __init__(self, path: Path, title: str, unpacked: Unpacked, lapses: Lapses) -> None:
        self.path, self.title, self.unpacked, self.lapses = path, title, unpacked, lapses
        self._files: dict[str, Path] = {}
        if not path.is_file():
            raise ScenarioError(
                f"{title} is a folder, expected an .ssp file." if path.is_dir() else missing_file(path, ".ssp")
            )
        try:
            with zipfile.ZipFile(path) as archive:
                entries = archive.infolist()
            demand_harmless(path, entries, MAX_UNPACKED_BYTES)
        except NotAnFmuError as error:
            raise ScenarioError(str(error).replace("an FMU must not", "a system structure package must not")) from error
        except (zipfile.BadZipFile, OSError, EOFError, ValueError, NotImplementedError) as error:
            raise ScenarioError(
                f"{title} is not a readable SSP: not a zip archive, or a broken one ({error})."
            ) from error
        self.sizes = {entry.filename: entry.file_size for entry in entries if not entry.is_dir()}
        if DEFAULT_VARIANT not in self.sizes:
            found = ", ".join(sorted(self.sizes)[:8]) or "nothing"
            raise ScenarioError(
                f"{title} is not an SSP: it has no {DEFAULT_VARIANT} at its top level; it holds {found}."
            )

    @property
    def variants(self) -> list[str]:
        """Names of the system structures at its top level, the default one first."""
        others = sorted(n for n in self.sizes if n.endswith(".ssd") and "/" not in n and n != DEFAULT_VARIANT)
        return [DEFAULT_VARIANT, *others]

    def read(self, name: str) -> bytes:
        """The content of a member that is XML.

        Args:
            name: of the element.

        Raises:
            ScenarioError: it is too large or damaged.
        """
        if self.sizes[name] > _MAX_XML_BYTES:
            raise ScenarioError(
                f"{self.title}: {name} has {self.sizes[name] / 1e6:.0f} MB; XML of at most 64 MB is read."
            )
        with self._opened(name) as source:
            return source.read()

    def file(self, name: str) -> Path:
        """A member as a file, unpacked once.

        Args:
            name: of the element.

        Raises:
            ScenarioError: it is damaged.
        """
        if name not in self._files:
            target = self.unpacked.fresh(PurePosixPath(name).name)
            with self._opened(name) as source, target.open("wb") as copy:
                shutil.copyfileobj(source, copy)
            self._files[name] = target
        return self._files[name]

    def member(self, node: Node, uri: str, base: str) -> str:
        """The member that a URI names.

        Args:
            node: where the URI stands, for messages. uri: relative to `base`. base: name of the member it stands in.

        Raises:
            ScenarioError: the URI leads out of the package, or there is no such member.
        """
        parts = urlsplit(uri)
        if parts.scheme or parts.netloc or parts.path.startswith("/"):
            fail(
                node,
                f"source {uri!r}: only files within the package can be used, by relative URIs such as "
                f"'resources/a.fmu'.",
            )
        name = posixpath.normpath(posixpath.join(posixpath.dirname(base), unquote(parts.path)))
        if name.startswith("../"):
            fail(node, f"source {uri!r} leads out of the package.")
        if name not in self.sizes:
            fail(node, f"source {uri!r}: the package has no such file; {nearest(name, sorted(self.sizes))}")
        return name

    @contextmanager
    def _opened(self, name: str) -> Iterator[IO[bytes]]:
        try:
            with zipfile.ZipFile(self.path) as archive, archive.open(name) as stream:
                yield stream
        except ScenarioError:
            raise
        except Exception as error:  # each compression throws its own: zlib.error, lzma.LZMAError
            raise ScenarioError(f"{self.title}: {name} is damaged: {error}") from error
