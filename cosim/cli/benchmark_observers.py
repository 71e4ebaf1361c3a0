"""``cosim benchmark-observers``: several observers on one recorded run of a scenario."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cosim.cli.scenarios import add_scenario, load_scenario, positive
from cosim.observer_benchmark.observers import benchmark_observers
from cosim.results.folder import check_writable
from cosim.results.summary_file import jsonable
from fmus.cli.progress import ProgressBar

if TYPE_CHECKING:
    from cosim.observer_benchmark.observers import ObserverBenchmark

DONE, NOT_AS_ASKED = 0, 1


def register(commands: Any) -> None:
    """Add the command to the parser.

    Args:
        commands: subparsers of the program.
    """
    description = (
        "Run the plant side of a scenario once, play it back to several observers, each alone, and compare errors, "
        "slip "
        "detection, certificates and cost."
    )
    epilog = (
        "Exit codes: 0 done, 1 an observer failed or could not be coupled, 2 error or interrupted; what was "
        "judged is printed."
    )
    parser = commands.add_parser("benchmark-observers", description=description, epilog=epilog)
    add_scenario(parser)
    parser.add_argument(
        "--observers",
        type=_names,
        metavar="A,B,...",
        help="components of the scenario or shipped observers (default: the scenario's own, and all shipped train "
        "observers "
        "whose inputs and event it can serve)",
    )
    source = parser.add_mutually_exclusive_group()
    source.add_argument("--record", metavar="DIR", help="keep the recorded run as a results folder")
    source.add_argument(
        "--from", metavar="DIR", dest="recorded", help="play back this results folder instead of a new run"
    )
    parser.add_argument(
        "--repeat", type=positive, default=1, metavar="N", help="runs of each observer, for the cost (default: 1)"
    )
    parser.add_argument("--out", metavar="DIR", help="also write page, picture and data to this folder")
    parser.add_argument("--json", action="store_true", help="print the data as JSON instead of the table")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    parser.set_defaults(execute=execute)


def execute(options: argparse.Namespace) -> int:
    """Compare, print and write.

    Args:
        options: of the command line.
    """
    for folder in (options.out, options.record):
        if folder is not None:
            check_writable(folder)
    bar = ProgressBar("run", silent=options.quiet or options.json)
    try:
        benchmark = benchmark_observers(
            load_scenario(options),
            options.observers,
            record=options.record,
            recorded=options.recorded,
            repeat=options.repeat,
            progress=lambda what, done, total: bar(done, total, what),
            warn=_warn,
        )
    finally:
        bar.close()
    paths = benchmark.write(options.out) if options.out is not None else {}
    _tell(benchmark, paths, as_json=options.json)
    if benchmark.interrupted:
        raise KeyboardInterrupt  # all there is has been told
    return NOT_AS_ASKED if benchmark.failed else DONE


def _tell(benchmark: ObserverBenchmark, paths: dict[str, Path], *, as_json: bool) -> None:
    if as_json:
        print(json.dumps(jsonable(benchmark.to_data() | {"files": {k: str(p) for k, p in paths.items()}}), indent=2))
        return
    print(benchmark.text())
    for kind, path in paths.items():
        print(f"{kind:>10}: {path}")


def _warn(text: str) -> None:
    print(f"warning: {text}", file=sys.stderr, flush=True)


def _names(text: str) -> list[str]:
    names = [name.strip() for name in text.split(",") if name.strip()]
    if not names:
        raise argparse.ArgumentTypeError("expected names separated by commas")
    return names
