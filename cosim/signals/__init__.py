"""Excitation and response as numbers: frequencies, windows, gains, harmonics, settling, rigid bodies, drives.

Read `frequency_response.py` first, and `drive.py` for signals of the user's own. It imports numpy, scipy for splines.
"""
