"""Parameter sets: the dimensions of a part in a TOML document, with comments on where they come from."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from hfsa.cosim.results.file_kind import PARAMETER_SET
from hfsa.cosim.results.placement import put_in_place, temporary_file
from hfsa.cosim.results.target import check_parameters, os_refusal


def write_parameter_set(path: Path, values: Mapping[str, float], remarks: Sequence[str], force: bool = False) -> None:
    """Write a parameter set, completely or not at all.

    Args:
        path: file, with the ending `.toml`.
        values: values by key.
        remarks: lines of comment.
        force: whether to replace a parameter set.

    Raises:
        ResultsError: as `check_parameters`, or for a full disk.
    """
    lines = [PARAMETER_SET, *(f"# {line}" for remark in remarks for line in remark.splitlines())]
    text = "\n".join([*lines, "", *(f"{key} = {value!r}" for key, value in values.items()), ""])
    with temporary_file(path) as part:
        try:
            part.write_text(text, encoding="utf-8")
        except OSError as error:
            raise os_refusal(path, error) from error
        put_in_place(part, path, lambda: check_parameters(path, force))
