"""Scenes: which parts, how connected, what is excited and what is recorded; plain data, one file each."""
