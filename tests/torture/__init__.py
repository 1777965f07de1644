"""Trials of what must not break: signals, damage, absurd calls, long runs, odd environments; `__main__.py` runs them.

One file, one kind of trial: `trials(seed, count)` draws about `count` of each from a seed and yields a `Row` for each
line of the table. A trial that does not hold is told by a sentence that repeats it.
"""
