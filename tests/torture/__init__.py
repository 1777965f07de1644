"""Trials that try to break hfsa: kills, damaged files, nonsense on the command line. `make torture` runs all.

One file, one kind of trial, with a function `trials(seed, count) -> Iterator[Row]`: `count` scales their number,
the seed repeats them. `row.py` is what a trial yields; `__main__.py` runs all files and writes `docs/torture.md`.
"""
