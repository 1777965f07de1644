"""FMUs as linear maps: their own derivatives, connected; and what the actions of a step do to them.

Read `linearize.py`, then `cycle.py`. It imports `actions` and what is below it.
"""
