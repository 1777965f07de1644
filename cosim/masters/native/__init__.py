"""The stepping loop in C99, bit for bit what the one in Python does.

Read `step.c`, then `stepping.py`. An action (`cosim/actions`) has its twin in a C file of its own: the header states a
structure and exports the function that performs it, `details.py` fills the structure in, and that is all.
"""
