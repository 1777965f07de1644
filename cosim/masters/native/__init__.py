"""The stepping loop in C99, bit for bit what the one in Python does.

Read `step.c`, then `stepping.py`.
"""
