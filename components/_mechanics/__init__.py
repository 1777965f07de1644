"""Mechanics that several parts share: screws, modes, rigid bodies; the robot, the stage, sensors and beams.

It knows no part. Read `screws.py` and `rigid_body.py` first.
"""
