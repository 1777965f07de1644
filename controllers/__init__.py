"""Controllers and analyses of control loops: each file defines one part, and its function returns a `Model`."""
