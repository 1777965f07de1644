"""Refusal of files that may have no end: devices, pipes, sockets."""

from pathlib import Path

from hfsa.components._modelling.errors import ModelError


def check_regular(file: Path, label: str) -> None:
    """Raise `ModelError` for what is neither a file nor a folder, of which nothing is read; nothing may be there."""
    if file.exists() and not (file.is_file() or file.is_dir()):
        raise ModelError(f"{label} is a device or a pipe, expected a file")
