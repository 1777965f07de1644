"""Size of the list of entries at the end of a ZIP archive, read before the list itself: it says what reading costs."""

import io
import struct
from typing import IO

_END, _END_64, _LOCATOR_64 = b"PK\x05\x06", b"PK\x06\x06", b"PK\x06\x07"
_LONGEST_END = 22 + 0xFFFF
"""Most bytes [bytes] of the last record with its comment."""


def directory_size(stream: IO[bytes]) -> int:
    """Return the size [bytes] that an archive states for the list of its entries; 0 where it states none."""
    length = stream.seek(0, io.SEEK_END)
    stream.seek(max(0, length - _LONGEST_END - 20))
    tail = stream.read()
    place = tail.rfind(_END)
    if place < 0 or len(tail) < place + 22:
        return 0
    (size,) = struct.unpack_from("<L", tail, place + 12)
    if place < 20 or tail[place - 20 : place - 16] != _LOCATOR_64:
        return size
    (offset,) = struct.unpack_from("<Q", tail, place - 12)
    if offset > length:
        return size
    stream.seek(offset)
    record = stream.read(56)
    return struct.unpack_from("<Q", record, 40)[0] if record[:4] == _END_64 and len(record) == 56 else size
