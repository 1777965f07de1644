"""The FMUs of a system as one differential equation, integrated by SUNDIALS.

Read `master.py` first.
"""
