"""Published numbers that no `analyze` returns, each a function by name, computed from the functions of the parts.

`published_sources` names them, a module for each source; every result is in SI units.
"""

from inspect import getmembers, isfunction

from published_probes import accelerometer, modules, sdelta, sdelta_modes, sdelta_motion, stage

PROBES = {
    name: function
    for module in (sdelta, sdelta_modes, sdelta_motion, stage, accelerometer, modules)
    for name, function in getmembers(module, isfunction)
    if function.__module__ == module.__name__ and not name.startswith("_")
}
"""All of them by name."""
