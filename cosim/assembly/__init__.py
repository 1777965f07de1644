"""From names to what can run: scenes by name, their components as FMU files, wired to the instruments.

Here begins the roof: only this room and those above it see parts and the exporter. Read `build.py` first.
"""
