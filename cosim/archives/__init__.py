"""Archives and XML of somebody else, opened in one place: FMUs and system structure packages.

Read `archive.py` first, then `xml.py` (whole documents) and `xml_stream.py` (documents of any length). Nothing is
unpacked, expanded or fetched before its names and sizes are checked; `limits.py` holds the limits.
"""
