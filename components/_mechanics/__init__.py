"""Mechanics that several parts share: screws, modes and rigid bodies, the SDelta, the 3-RRR stage, sensors and beams.

No module in this package imports a part. Read `screws.py` and `rigid_body.py` first.
"""
