"""The command `hfsa`: parses, nothing else.

Each verb is a file of `commands/`, found by its name. What a verb needs is imported when it runs, so that
`hfsa --help` is there at once.
"""

import importlib
import os
import pkgutil
import sys

from cyclopts import App, CycloptsError

from hfsa.cosim import commands
from hfsa.cosim.commands import _shell

app = App(
    name="hfsa",
    help="Components, co-simulation and frequency sweeps for high-frequency, small-amplitude machines, made of FMUs.",
    help_epilogue="Exit codes: 0 done, 1 a check found problems or points failed, 2 wrong usage, 3 build failed, "
    "4 simulation failed, 130 interrupted, 143 ended by SIGTERM, 129 by SIGHUP. "
    "With --traceback, an error shows where it was raised.",
    version_flags=["--version"],
    suppress_keyboard_interrupt=False,
)
for _info in pkgutil.iter_modules(commands.__path__):
    if not _info.name.startswith("_"):
        _verb = getattr(importlib.import_module(f"{commands.__name__}.{_info.name}"), _info.name)
        app.command(_verb, name=_info.name)


def main(tokens: list[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    # matrices are small here, and jobs are processes: threads of linear algebra would only wait for each other
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    words = sys.argv[1:] if tokens is None else tokens
    traced = _shell.TRACEBACK in words

    def verb() -> int:
        """Parse and run; a wrong word has been reported by then."""
        rest = [word for word in words if word != _shell.TRACEBACK]
        try:
            return app(rest, exit_on_error=False, print_error=True, result_action="return_value") or _shell.DONE
        except CycloptsError:
            return _shell.USAGE

    return _shell.run(verb, traced)


if __name__ == "__main__":
    sys.exit(main())
