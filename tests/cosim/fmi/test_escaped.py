"""Processes that leave the session of the FMU that started them end with the command."""

import subprocess
import sys
import time
from pathlib import Path

import pytest

RUNAWAY = """
import os, subprocess, sys
from hfsa.cosim.fmi.isolation.escaped import escaped_processes_ended
with escaped_processes_ended():
    child = "import subprocess as s; print(s.Popen(['sleep', '60'], start_new_session=True, stdout=s.DEVNULL).pid)"
    print(subprocess.run([sys.executable, "-c", child], stdout=subprocess.PIPE, text=True).stdout.strip(), flush=True)
    sys.stdin.readline()
print("ended", flush=True)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="orphans are adopted on Linux alone")
def test_a_process_that_has_left_its_session_ends_with_the_block():
    with subprocess.Popen(
        [sys.executable, "-c", RUNAWAY], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as command:
        assert command.stdin is not None
        assert command.stdout is not None
        runaway = Path("/proc", command.stdout.readline().strip())
        assert runaway.exists()
        command.stdin.write("\n")
        command.stdin.flush()
        assert command.stdout.readline() == "ended\n"
    while runaway.exists():  # the timeout of the test ends this
        time.sleep(0.01)
