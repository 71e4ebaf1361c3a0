"""What the benchmarks share: the processor time of a call, and a program of named sections."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping


def seconds(call: Callable[[], object]) -> float:
    """CPU time of a call [s]."""
    begin = time.process_time()
    call()
    return time.process_time() - begin


def run_sections(sections: Mapping[str, Callable[[], None]]) -> None:
    """Run the sections named on the command line, or all."""
    unknown = [name for name in sys.argv[1:] if name not in sections]
    if unknown:
        raise SystemExit(f"There is no section {', '.join(unknown)}; there are: {', '.join(sections)}.")
    for name in sys.argv[1:] or sections:
        sections[name]()
