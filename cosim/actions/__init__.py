"""Actions of a communication step: fetch, set, step, extrapolate, iterate, feed back, solve, record.

An algorithm (`masters/`) is an order of these actions; `linear/` holds the linear map of each. Read `action.py` and
`wiring.py` first. It imports `fmi`, `systems` and `signals`.
"""
