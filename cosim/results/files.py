"""Results files of sweeps and runs in HDF5: created complete, written point by point, resumed, read by name.

    with SweepFile.create(path, plan, system) as file:      # or SweepFile.resume(path, plan, system)
        for i, k in file.unfinished():                      # input, frequency
            file.write([Point(i, k, response, ...)])
    bode = read_sweep(path)
    bode.entry("robot.platform.position[3]", "reference.command.position[3]")    # complex, shape (frequencies,)

    /            title created tool tool_version git_commit command python platform format_version status
    /system      the scene as text, components in the order in which they step; one group per FMU; operating_point;
                 driven_name, driven_signal, driven_sha256: inputs driven by signals, each as text and hash of its data
    /sweep       settings of the measurement, as attributes
    /bode        frequency [Hz], output, input: dimension scales; output_unit, input_unit, amplitude
                 response (complex, output per input), magnitude, phase [rad], harmonic_distortion, harmonics of a sine:
                 mean, with its sign, and amplitudes to the third harmonic over (frequency, harmonic, output, input),
                 remaining_transient, step_error: relative error due to the communication steps, NaN if unknown
                 status, wall_time [s], message, over (frequency, input)
                 of a multisine: line_amplitude, line_phase [rad] over (frequency, input), crest_factor(input)
    /time        time [s] and one dataset per recorded variable; error_estimate, relative_error: their attributes;
                 step_size: communication step [s], of which a row may be a multiple; limit_flags: names of those

Units are SI, frequency is in Hz. xarray opens a group with its coordinates: `open_dataset(path, group="bode",
engine="h5netcdf")`. Only one process may write a file.
An existing file is not overwritten unless `force` allows it (`results/target.py`). This module is the face of the room.
"""

from hfsa.cosim.results.bode import Bode, read_sweep
from hfsa.cosim.results.choices import read_algorithm, read_choices, read_driven, read_order
from hfsa.cosim.results.locks import Identity
from hfsa.cosim.results.records import (
    AlgorithmChoice,
    DrivenInput,
    ErrorEstimate,
    InstanceRecord,
    LevelChoice,
    Lines,
    OrderChoice,
    Plan,
    Point,
    ResultsError,
    Signal,
    Status,
    SystemRecord,
    Theory,
)
from hfsa.cosim.results.run_file import (
    RunFile,
    read_errors,
    read_limit_flags,
    read_run,
    read_status,
    read_step_size,
    read_warnings,
    write_errors,
)
from hfsa.cosim.results.sweep_file import SweepFile

__all__ = [
    "AlgorithmChoice",
    "Bode",
    "DrivenInput",
    "ErrorEstimate",
    "Identity",
    "InstanceRecord",
    "LevelChoice",
    "Lines",
    "OrderChoice",
    "Plan",
    "Point",
    "ResultsError",
    "RunFile",
    "Signal",
    "Status",
    "SweepFile",
    "SystemRecord",
    "Theory",
    "read_algorithm",
    "read_choices",
    "read_driven",
    "read_errors",
    "read_limit_flags",
    "read_order",
    "read_run",
    "read_status",
    "read_step_size",
    "read_sweep",
    "read_warnings",
    "write_errors",
]
