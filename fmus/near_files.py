"""Files that may be meant by a path that leads nowhere. Standard library only."""

from __future__ import annotations

from difflib import get_close_matches
from pathlib import Path

_ALIKE = 0.65
_MOST = 3


_KINDS = {".toml": "a scenario", ".ssp": "a scenario", ".fmu": "an FMU", ".csv": "a table", ".mat": "a table"}
"""What files are, by their endings."""


def what_it_is(path: Path) -> str:
    """What stands at a path, where something else was expected.

    Args:
        path: as it was stated.

    Returns:
        Such as "a scenario"; empty where there is nothing, or a file of a kind that is not known.
    """
    if path.is_dir():
        return "a results folder" if (path / "summary.json").is_file() else "a folder"
    return _KINDS.get(path.suffix.lower(), "") if path.is_file() else ""


def missing_file(path: Path, *endings: str) -> str:
    """That a file does not exist, with what may be meant.

    Args:
        path: that leads nowhere. endings: as for `near_files`.
    """
    return f"{str(path).encode('unicode_escape').decode()} does not exist; {near_files(path, *endings)}"


def near_files(path: Path, *endings: str) -> str:
    """A hint with the names of files nearest to one that does not exist.

    Args:
        path: that leads nowhere. endings: of names that can be meant, such as ``.toml``; none for any.

    Returns:
        The end of a sentence: the nearest names, or what there is, or that there is no folder.
    """
    if any(ord(c) < 32 for c in str(path)):
        return "in its name \\ was read as the begin of a control character; write / or single quotation marks."
    folder = path.parent
    if not folder.is_dir():
        return f"there is no folder {folder}."
    names = sorted(p.name for p in folder.iterdir() if not p.name.startswith("."))
    fitting = [name for name in names if not endings or name.lower().endswith(endings)]
    stems = get_close_matches(path.stem, {Path(name).stem for name in fitting}, _MOST, _ALIKE)  # endings are all alike
    near = [name for stem in stems for name in fitting if Path(name).stem == stem][:_MOST]
    if near:
        return f"did you mean {', '.join(repr(name) for name in near)}?"
    shown = ", ".join(fitting[:8]) + (", ..." if len(fitting) > 8 else "")
    return f"in that folder there is: {shown}." if fitting else f"that folder has no {' or '.join(endings) or 'file'}."
