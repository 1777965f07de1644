"""Excitation and response as numbers: frequencies, windows, gains, harmonics, settling, prefixes.

Read `frequency_response.py` first. It imports numpy alone.
"""
