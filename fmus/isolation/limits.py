"""What an FMU in a process of its own may take. Standard library only."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class OwnProcess:
    """A process of its own for an FMU, by what it may take; it is ended where it takes more, or is refused it.

    Args:
        processes: that it may have running beside it. memory: of all of them [bytes].
        files: open at a time in each. file_bytes: of one file. output_bytes: printed between two calls past its logger;
            what is beyond is lost.
    """

    processes: int = 32
    memory: int = 4 * 1024**3
    files: int = 1024
    file_bytes: int = 1024**3
    output_bytes: int = 64 * 1024
