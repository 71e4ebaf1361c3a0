"""``cosim benchmark-observers``: several observers on one recorded run of a scenario."""

from __future__ import annotations

import argparse

from cosim.choice.benchmark import benchmark_observers
from cosim.cli.arguments import QUIET, positive, scenario_arguments
from cosim.cli.output import print_warning
from cosim.cli.scenarios import load_scenario
from cosim.results.results_folder import check_writable
from fmus.cli.commands import argument, one_of
from fmus.cli.output import Output
from fmus.cli.progress import ProgressBar

DONE, NOT_AS_ASKED = 0, 1


def _names(text: str) -> list[str]:
    names = [name.strip() for name in text.split(",") if name.strip()]
    if not names:
        raise argparse.ArgumentTypeError("expected names separated by commas")
    return names


GROUP = "Observers"
PLACE = 1
HELP = "compare observers on one recorded run"
EXAMPLES = ("cosim benchmark-observers vendor.toml",)
PARSER = {
    "description": (
        "Run the plant side of a scenario once, play it back to several observers, each alone, and compare errors,"
        " slip detection, certificates and cost."
    ),
    "epilog": (
        "Exit codes: 0 done, 1 an observer failed or could not be coupled, 2 error or interrupted; what was evaluated"
        " is printed."
    ),
}
ARGUMENTS = (
    *scenario_arguments(),
    argument(
        "--observers",
        type=_names,
        metavar="A,B,...",
        help="components of the scenario or shipped observers (default: the scenario's own, and all shipped train "
        "observers whose inputs and event it can serve)",
    ),
    one_of(
        argument("--record", metavar="DIR", help="keep the recorded run as a results folder"),
        argument("--from", metavar="DIR", dest="recorded", help="play back this results folder instead of a new run"),
    ),
    argument(
        "--repeat", type=positive, default=1, metavar="N", help="runs of each observer, for the cost (default: 1)"
    ),
    argument("--out", metavar="DIR", help="also write page, picture and data to this folder"),
    QUIET,
)


def execute(options: argparse.Namespace) -> Output:
    """Compare, and write where the options ask for it."""
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
            warn=print_warning,
        )
    finally:
        bar.close()
    paths = benchmark.write(options.out) if options.out is not None else {}
    return Output(
        benchmark.parts(),
        benchmark.to_data(),
        paths,
        NOT_AS_ASKED if benchmark.failed else DONE,
        error=KeyboardInterrupt() if benchmark.interrupted else None,
    )
