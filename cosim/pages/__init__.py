"""Pages in HTML that need nothing but a browser: no network, no server, one file each.

Begin with `page.py`, the frame of every page. `drawing_page.py` fills it with drawings of a part, which turn, move and
answer to the pointer.
"""
