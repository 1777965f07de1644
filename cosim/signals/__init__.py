"""Excitation and response as numbers: frequencies, windows, gains, harmonics, settling, rigid bodies, prefixes.

Read `frequency_response.py` first. It imports numpy alone.
"""
