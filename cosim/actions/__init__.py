"""What a communication step is made of: fetch, set, step, extrapolate, iterate, feed back, solve, record.

An algorithm (`masters/`) is an order of these actions, and `linear/` knows the linear map of each. Read `action.py` and
`wiring.py` first. It imports `fmi`, `systems` and `signals`.
"""
