"""Systems and scenes as plain data: components, connections, names, the files they are kept in.

Read `system.py`, then `scene.py`. It imports nothing of the other rooms.
"""
