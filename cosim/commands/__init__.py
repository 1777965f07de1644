"""The verbs of the command line: options in, words out.

Read `_shell.py` first. It imports `experiments` and whatever is below.
"""
