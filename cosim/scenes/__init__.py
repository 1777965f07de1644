"""Scenes as plain data, one file each: components, connections, excited inputs and recorded outputs."""
