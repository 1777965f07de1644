"""Systems and scenes as plain data: components, connections, names and scene files.

Read `system.py`, then `scene.py`. It imports nothing of the other rooms.
"""
