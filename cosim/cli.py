"""Command `hfsa`: the parser of the command line.

Each verb is a file of `commands/`, found by its name. A verb imports its libraries when it runs, so that `hfsa --help`
is fast; `hfsa --version` needs no parser.
"""

import ast
import os
import sys
from contextlib import nullcontext
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from hfsa.cosim import commands
from hfsa.cosim.archives.scratch import scratch_folder
from hfsa.cosim.commands import _shell
from hfsa.cosim.fmi.isolation.escaped import escaped_processes_ended

if TYPE_CHECKING:
    from cyclopts import App

_VERSION = "--version"


@cache
def parser() -> "App":
    """Return the parser, with all verbs."""
    from cyclopts import App

    app = App(
        name="hfsa",
        help="Components, co-simulation and frequency sweeps for high-frequency, small-amplitude machines, made of "
        "FMUs.",
        help_epilogue="Exit codes: 0 done, 1 a check found problems or points failed, 2 wrong usage, 3 build failed, "
        "4 simulation failed, 130 interrupted, 143 ended by SIGTERM, 129 by SIGHUP. "
        "With --traceback, an error prints its traceback.",
        version=lambda: version("hfsa"),
        version_flags=[_VERSION],
        suppress_keyboard_interrupt=False,
    )
    for file in sorted(Path(commands.__path__[0]).glob("[!_]*.py")):
        app.command(f"{commands.__name__}.{file.stem}:{file.stem}", name=file.stem, help=_help(file))
    return app


def _help(file: Path) -> str:
    """Return the docstring of the function of a verb, without its parameters and without importing it."""
    functions = (node for node in ast.parse(file.read_text(encoding="utf-8")).body if isinstance(node, ast.FunctionDef))
    verb = next(node for node in functions if node.name == file.stem)
    return (ast.get_docstring(verb) or "").partition("\nParameters\n")[0].strip()


def main(tokens: list[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    # matrices are small and jobs are threads or processes: threads of linear algebra would wait for each other
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    if tokens is None:
        _shell.open_streams()
    words = sys.argv[1:] if tokens is None else tokens
    traced = _shell.TRACEBACK in words

    def verb() -> int:
        """Parse and run; the parser has reported a wrong word."""
        rest = [word for word in words if word != _shell.TRACEBACK]
        if rest == [_VERSION]:
            print(version("hfsa"), flush=True)
            return _shell.DONE
        from cyclopts import CycloptsError

        # words are given where another program calls, whose temporary files and processes are its own
        place, ends = (scratch_folder(), escaped_processes_ended()) if tokens is None else (nullcontext(),) * 2
        try:
            with place, ends:
                return (
                    parser()(rest, exit_on_error=False, print_error=True, result_action="return_value") or _shell.DONE
                )
        except CycloptsError:
            return _shell.USAGE

    return _shell.run(verb, traced)


if __name__ == "__main__":
    sys.exit(main())
