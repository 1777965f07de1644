"""Verbs of the command line, one file each: parse options, run an experiment, print the answer.

Read `_shell.py` first. It imports `experiments` and whatever is below.
"""
