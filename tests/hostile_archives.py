"""Archives that try to do harm, made of a harmless FMU."""

import io
import struct
import warnings
import zipfile
from collections.abc import Iterable

DOCUMENT = "modelDescription.xml"

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Box" guid="g">
  <CoSimulation modelIdentifier="Box"/>
  <ModelVariables>
    <ScalarVariable name="y" valueReference="0" causality="output"><Real/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="1"/></Outputs></ModelStructure>
</fmiModelDescription>"""

Entry = tuple[str | zipfile.ZipInfo, bytes | str]


def zipped(entries: Iterable[Entry] = (), description: bytes | str = DESCRIPTION, method: int = 8) -> bytes:
    """Return an FMU with further entries."""
    stream = io.BytesIO()
    with warnings.catch_warnings(), zipfile.ZipFile(stream, "w", method) as archive:
        warnings.simplefilter("ignore")  # of two entries of one name
        for name, content in ((DOCUMENT, description), *entries):
            archive.writestr(name, content)
    return stream.getvalue()


def link(name: str, target: str) -> Entry:
    """Return an entry that is a symbolic link."""
    info = zipfile.ZipInfo(name)
    info.create_system, info.external_attr = 3, 0o120777 << 16
    return info, target


def encrypted() -> bytes:
    """Return an FMU whose entries say that they are encrypted."""
    data = bytearray(zipped())
    for signature, place in ((b"PK\x01\x02", 8), (b"PK\x03\x04", 6)):
        data[data.index(signature) + place] |= 1
    return bytes(data)


def lying(size: int) -> bytes:
    """Return an FMU with an entry of a megabyte that states another size [bytes] in both lists."""
    data = bytearray(zipped([("resources/zeros", bytes(1 << 20))]))
    for signature, place in ((b"PK\x01\x02", 24), (b"PK\x03\x04", 22)):
        struct.pack_into("<L", data, data.rindex(signature) + place, size)
    return bytes(data)


def directory_of(size: int) -> bytes:
    """Return an FMU that states a size [bytes] of its list of entries."""
    data = bytearray(zipped())
    struct.pack_into("<L", data, data.rindex(b"PK\x05\x06") + 12, size)
    return bytes(data)


def damaged() -> bytes:
    """Return an FMU whose resource has a wrong bit."""
    data = bytearray(zipped([("resources/text", b"0123456789" * 20)], method=0))
    data[data.index(b"0123456789") + 4] ^= 1
    return bytes(data)


BOMB = zipped([("resources/zeros", bytes(65 << 20))])

REFUSED: dict[str, tuple[bytes, str]] = {
    "empty": (b"", "is not a readable FMU"),
    "text": (b"hello\n" * 100, "is not a readable FMU"),
    "cut": (zipped()[:-30], "is not a readable FMU"),
    "upwards": (zipped([("../evil", b"x")]), "the entry '../evil' leaves the archive"),
    "upwards-inside": (zipped([("resources/../../evil", b"x")]), "leaves the archive"),
    "absolute": (zipped([("/tmp/evil", b"x")]), "leaves the archive"),
    "drive": (zipped([("C:/evil", b"x")]), "leaves the archive"),
    "backslash-upwards": (zipped([("resources\\..\\..\\evil", b"x")]), "leaves the archive"),
    "backslash": (zipped([("resources\\evil", b"x")]), "has a character that no path in an archive has"),
    "new-line": (zipped([("resources/new\nline", b"x")]), "has a character that no path in an archive has"),
    "right-to-left": (zipped([("resources/\u202egnp.exe", b"x")]), "has a character that no path in an archive has"),
    "link": (zipped([link("resources/link", "/etc/passwd")]), "the entry 'resources/link' is a link"),
    "encrypted": (encrypted(), "is encrypted"),
    "lzma": (zipped(method=zipfile.ZIP_LZMA), "is compressed by method 14, expected stored or deflated"),
    "deep": (zipped([("d/" * 2000 + "f", b"x")]), "lies 2001 folders deep, expected at most 64"),
    "long-name": (zipped([("n" * 300, b"x")]), "has a name of more than 255 bytes"),
    "two-contents": (zipped([("a", b"1"), ("a", b"2")]), "has two different entries 'a'"),
    "two-ways": (zipped([("a", b"1"), ("./a", b"2")]), "has two different entries 'a'"),
    "file-and-folder": (zipped([("a", b"1"), ("a/b", b"2")]), "'a' is a file, and the folder of 'a/b'"),
    "bomb": (BOMB, "unpacks to 68,157,"),
    "long-directory": (directory_of(0x7FFFFFFF), "the list of its entries takes 2,147,483,647 bytes"),
}
"""Archives that are refused before anything is unpacked, each with part of the sentence."""
