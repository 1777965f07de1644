"""Icons of an FMU, drawn from its name and its terminals, as PNG, which all tools show, and as SVG."""

import io
from collections.abc import Sequence

from lxml import etree

from hfsa.fmus._terminals import FOLDER, PORT, SIZE, Terminal

ICON = f"{FOLDER}/icon.png"
"""Path of the icon in the archive."""

_INK, _PAPER, _FLANGE, _SIGNAL = "#1f3a5f", "#f7f9fc", "#1f3a5f", "#ffffff"
_SCALE = 2
_SVG = "{http://www.w3.org/2000/svg}"


def icons(name: str, terminals: Sequence[Terminal]) -> dict[str, bytes]:
    """Return the files of the icons by path in the archive: of the FMU, and of a terminal."""
    shapes = [*_frame(), *(shape for terminal in terminals for shape in _port(terminal))]
    labels = [_label(name, 0.0, 0.0, "middle", _size_of(name)), *map(_port_label, terminals)]
    port = [(0.0, 0.0, float(PORT), _SIGNAL)]
    return {
        ICON: _png(SIZE, shapes, labels),
        f"{FOLDER}/icon.svg": _svg(SIZE, shapes, labels),
        f"{FOLDER}/terminal.png": _png(PORT, port, []),
        f"{FOLDER}/terminal.svg": _svg(PORT, port, []),
    }


Square = tuple[float, float, float, str]
"""Square with an edge: x and y of its centre, size, colour."""

Label = tuple[str, float, float, str, float]
"""Text: what, x and y, `start`, `middle` or `end` there, height of the letters."""


def _frame() -> list[Square]:
    """Return the body."""
    return [(0.0, 0.0, float(SIZE - PORT), _PAPER)]


def _port(terminal: Terminal) -> list[Square]:
    """Return the square of a terminal: filled for a flange, empty for signals."""
    return [(terminal.x, terminal.y, float(PORT), _FLANGE if terminal.is_flange else _SIGNAL)]


def _port_label(terminal: Terminal) -> Label:
    """Return the name of a terminal beside its square, inside the body."""
    is_left = terminal.x < 0
    return _label(
        terminal.name, terminal.x + (PORT if is_left else -PORT), terminal.y, "start" if is_left else "end", 9
    )


def _label(text: str, x: float, y: float, anchor: str, size: float) -> Label:
    """Return a text, cut where it is longer than a quarter of a line of names."""
    return (text if len(text) <= 24 else text[:23] + "…", x, y, anchor, size)


def _size_of(name: str) -> float:
    """Return the height of the letters with which a name fits between the terminals."""
    return max(7.0, min(18.0, 0.6 * SIZE / (0.6 * max(len(name), 1))))


def _png(size: int, squares: Sequence[Square], labels: Sequence[Label]) -> bytes:
    """Return a picture of `size` units as PNG."""
    from PIL import Image, ImageDraw, ImageFont

    image = Image.new("RGBA", (size * _SCALE, size * _SCALE), (0, 0, 0, 0))
    draw = ImageDraw.Draw(image)
    for x, y, width, colour in squares:
        left, top = (size / 2 + x - width / 2) * _SCALE, (size / 2 - y - width / 2) * _SCALE
        right, bottom = left + width * _SCALE - 1, top + width * _SCALE - 1
        draw.rectangle((left, top, right, bottom), fill=colour, outline=_INK, width=_SCALE)
    for text, x, y, anchor, height in labels:
        place = (size / 2 + x) * _SCALE, (size / 2 - y) * _SCALE
        font = ImageFont.load_default(height * _SCALE)
        draw.text(place, text, fill=_INK, font=font, anchor={"start": "lm", "middle": "mm", "end": "rm"}[anchor])
    file = io.BytesIO()
    image.save(file, "PNG")
    return file.getvalue()


def _svg(size: int, squares: Sequence[Square], labels: Sequence[Label]) -> bytes:
    """Return the same picture as SVG."""
    corner = f"{-size / 2:g}"
    box = {"viewBox": f"{corner} {corner} {size} {size}", "width": str(size), "height": str(size)}
    root = etree.Element(f"{_SVG}svg", box, nsmap={None: _SVG[1:-1]})  # type: ignore[dict-item]
    for x, y, width, colour in squares:
        place = {"x": f"{x - width / 2:g}", "y": f"{-y - width / 2:g}", "width": f"{width:g}", "height": f"{width:g}"}
        etree.SubElement(root, f"{_SVG}rect", {**place, "fill": colour, "stroke": _INK})
    for text, x, y, anchor, height in labels:
        place = {"x": f"{x:g}", "y": f"{-y:g}", "text-anchor": anchor, "dominant-baseline": "central"}
        look = {"font-family": "sans-serif", "font-size": f"{height:g}", "fill": _INK}
        etree.SubElement(root, f"{_SVG}text", place | look).text = text
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
