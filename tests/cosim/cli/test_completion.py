"""What shells offer for the last word of a line: commands, actions, options, their values, names that ship, files."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from cosim.cli import PROGRAM as COSIM
from cosim.scenario.shipped import shipped_scenarios
from fmu_observer import OBSERVERS
from fmus.cli import PROGRAM as FMUS
from fmus.cli.commands import CommandProgram, find_commands
from fmus.cli.completion import SHELLS

ASKED = {
    "bash": """{script}
COMP_WORDS=({words}); COMP_CWORD={last}; _{name}; printf '%s\\n' "${{COMPREPLY[@]}}"
""",
    "zsh": """compdef() {{ }}
_files() {{ print -l -- *(N) }}
compadd() {{ shift; print -l -- ${{(P)1}} }}
{script}
words=({words}); CURRENT=$(( {last} + 1 )); _{name}
""",
    "fish": """{script}
complete --do-complete {line}
""",
}
"""How a shell is asked, as a script; zsh completes in a terminal alone, whose part is played by three functions."""
OPTIONS = {"bash": ["--norc"], "zsh": ["-f"], "fish": ["--no-config"]}


def offered(shell: str, program: CommandProgram, *typed: str, folder: Path) -> set[str]:
    """What a shell offers for the last of the words that are typed behind the program."""
    path = shutil.which(shell)
    if path is None and os.environ.get("CI"):
        pytest.fail(f"{shell} is not installed (.ci/run installs it)")
    if path is None:
        pytest.skip(f"{shell} is not installed")
    words = [program.name, *typed]
    script = ASKED[shell].format(
        script=program.completion(shell),
        words=shlex.join(words),
        last=len(words) - 1,
        name=program.name,
        line=shlex.quote(" ".join(words)),
    )
    done = subprocess.run(
        [path, *OPTIONS[shell], "-c", script], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.stderr == ""
    found = {line.partition("\t")[0].replace("\\ ", " ") for line in done.stdout.splitlines()}
    return {word for word in found if word.startswith(typed[-1]) and word}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("vendor.toml", "a train.toml"):
        (tmp_path / name).touch()
    return tmp_path


@pytest.mark.parametrize("shell", SHELLS)
def test_a_shell_completes_what_can_be_typed(shell: str, folder: Path) -> None:
    def cosim(*typed: str) -> set[str]:
        return offered(shell, COSIM, *typed, folder=folder)

    assert cosim("sw") == {"sweep"}
    assert cosim("") - {"--help", "--version"} == {command.name for command in find_commands("cosim.cli")}
    assert cosim("run", "ven") == {"vendor.toml"}
    assert cosim("run", "a") == {"a train.toml"} | {name for name in shipped_scenarios() if name.startswith("a")}
    assert cosim("run", "vendor.toml", "--no-r") == {"--no-report"}
    assert cosim("baseline", "upd") == {"update"}
    assert cosim("baseline", "check", "--agai") == {"--against"}
    assert cosim("run", "--aga") == set()
    assert cosim("certify", "--by", "") == {"sufficient", "exact"}
    assert cosim("certify", "takagi") == {name for name in OBSERVERS if name.startswith("takagi")}
    assert cosim("new", "vendor.fmu", "--observer", "quasi") == {n for n in OBSERVERS if n.startswith("quasi")}
    assert offered(shell, FMUS, "build", "--plat", folder=folder) == {"--platform"}


def test_a_shell_that_is_not_known_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        COSIM.run(["--completion", "tcsh"])
    assert ended.value.code == 2
    said = "cosim: no completion for 'tcsh'; there is one for bash, zsh, fish (see 'cosim --help')\n"
    assert capsys.readouterr() == ("", said)


@pytest.mark.parametrize("shell", SHELLS)
def test_the_script_is_printed(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert COSIM.run(["--completion", shell]) == 0
    assert capsys.readouterr().out == f"{COSIM.completion(shell)}\n"
