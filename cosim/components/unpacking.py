"""Unpacking: an FMU is read and unpacked once for its content in a process, whatever file it comes from.

No instance works on these files: each gets a copy of its own, since an FMU may write into its folder, and since two
instances that share the file of a library share what the library keeps beside its instances.
"""

from __future__ import annotations

import atexit
import os
import pickle
import shutil
import zipfile
from collections import OrderedDict
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import mkdtemp

from cosim.errors import FmuLoadError
from fmus.fmi.archive import MAX_UNPACKED_BYTES, Archive, open_archive
from fmus.fmi.standard import fmi_version
from plant_models.code_trust import WHY_NOT, is_looking, remember
from plant_models.disk_cache.files import file_digest
from plant_models.left_behind import owned
from plant_models.user_file import CodeNotRunError

VERSIONS = ("1.0", "2.0", "3.0")
KEPT = 16
"""Contents that are kept, those used last; what is met again after more others is unpacked again."""

_FOR_READERS = ("sources/", "documentation/")
"""Folders that an instance of FMI 2 or 3 is not informed of."""


@dataclass
class _Content:
    """What is known of the FMU files with one content.

    Args:
        archive: what is in it, pickled: whoever asks gets a description of his own. folder: where it is unpacked.
    """

    archive: bytes
    folder: Path | None = None


_contents: OrderedDict[str, _Content] = OrderedDict()
_owner = [0]


def read_archive(path: Path) -> Archive:
    """Look at an FMU file; nothing is unpacked.

    Args:
        path: the file.

    Returns:
        What is in it, with a model description that nobody else has.

    Raises:
        NotAnFmuError: as `fmus.fmi.archive.open_archive`.
    """
    digest = _digest(path)
    known = None if digest is None else _contents.get(digest)
    if digest is not None and known is not None:
        _contents.move_to_end(digest)
        kept: Archive = pickle.loads(known.archive)  # written below, in this process
        return replace(kept, path=path)
    archive = open_archive(path, MAX_UNPACKED_BYTES, VERSIONS)
    if digest is not None:
        with suppress(RecursionError):  # a description of very many linked parts
            _keep(digest, _Content(pickle.dumps(archive)))
    return archive


def unpack(archive: Archive) -> Path:
    """A new folder with the files of an FMU that its instances may use; whoever asks for it removes it. The library in
    it is code: nothing is unpacked where nothing is run, and the FMU is noted as one that was run here.

    Args:
        archive: what `read_archive` returned.

    Returns:
        The folder.

    Raises:
        Exception: the archive is damaged, or the disk full; each compression throws its own.
        FmuLoadError: nothing is run, see `plant_models.code_trust.looking`.
    """
    if is_looking():
        text = f"The library of {archive.path} {WHY_NOT}."
        raise FmuLoadError(text) from CodeNotRunError(text)
    digest = _digest(archive.path)
    remember([archive.path])
    content = None if digest is None else _contents.get(digest)
    folder = Path(mkdtemp(prefix=owned("fmu_")))
    try:
        if content is None:
            _extract(archive, folder)
        else:
            _copy(archive, content, folder)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return folder


def _copy(archive: Archive, content: _Content, folder: Path) -> None:
    """Fill a folder from the unpacked content, which is unpacked where that was not done, or is gone."""
    if content.folder is not None:
        try:
            shutil.copytree(content.folder, folder, dirs_exist_ok=True)
        except OSError:  # somebody tidied up
            content.folder = None
        else:
            return
    _extract(archive, folder)
    content.folder = Path(shutil.copytree(folder, Path(mkdtemp(prefix=owned("fmu_content_"))), dirs_exist_ok=True))


def _extract(archive: Archive, folder: Path) -> None:
    left_out = () if fmi_version(archive.description) == 1 else _FOR_READERS
    with zipfile.ZipFile(archive.path) as file:
        file.extractall(folder, [name for name in archive.names if not name.startswith(left_out)])
    archive.add_compiled(folder)


def _digest(path: Path) -> str | None:
    if _owner[0] != os.getpid():  # a copied process leaves the folders to the one that made them
        _contents.clear()
        _owner[0] = os.getpid()
    try:
        return file_digest(path)
    except OSError:
        return None


def _keep(digest: str, content: _Content) -> None:
    _contents[digest] = content
    while len(_contents) > KEPT:
        _remove(_contents.popitem(last=False)[1])


@atexit.register
def _forget_all() -> None:
    """Remove what is kept, as at the end of the process."""
    if _owner[0] == os.getpid():
        while _contents:
            _remove(_contents.popitem()[1])


def _remove(content: _Content) -> None:
    if content.folder is not None:
        shutil.rmtree(content.folder, ignore_errors=True)
