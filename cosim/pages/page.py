"""Frame of a page: title, style, scripts and data in one HTML file.

    write_page(Path("robot.html"), Page("SDelta", body, ("drawing.js",), data))

Scripts of `assets/` are inlined, plotly once, and data as JSON. A page larger than `LARGEST` is refused.
"""

import html
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from hfsa.cosim.results.file_kind import PAGE_SIGNATURE
from hfsa.cosim.results.placement import Bound, write_bounded
from hfsa.cosim.results.target import check_page

LARGEST = Bound(30e6, "page", "a coarser mesh or fewer points")
"""Largest size of a page [bytes]."""


@dataclass(frozen=True)
class Page:
    """A page.

    Attributes:
        title: title of the page and its heading.
        body: its content below the heading, as HTML.
        scripts: names of scripts in `assets/`, which run in this order after plotly.
        data: what the scripts draw, as plain data.
    """

    title: str
    body: str
    scripts: Sequence[str] = ()
    data: Mapping[str, Any] | None = None


def write_page(path: Path, page: Page) -> None:
    """Write a page, completely or not at all.

    `ResultsError` for a page larger than `LARGEST`, for an existing file that is no page of hfsa, and where the file
    cannot be written.
    """
    check_page(path)
    content = text(page).encode("utf-8", "backslashreplace")
    write_bounded(path, content, LARGEST, lambda: check_page(path))


def text(page: Page) -> str:
    """Return a page as HTML."""
    title = html.escape(page.title)
    inlined = "".join(f"<script>\n{_asset(name)}</script>\n" for name in page.scripts)
    return (
        f"{PAGE_SIGNATURE}\n"
        '<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{title}</title>\n<style>\n{_asset('page.css')}</style>\n"
        f"<script>{_plotly()}</script>\n</head>\n<body>\n<h1>{title}</h1>\n{page.body}\n"
        f'<script type="application/json" id="data">{_embedded(page.data or {})}</script>\n'
        f"{inlined}</body>\n</html>\n"
    )


def _embedded(data: Mapping[str, Any]) -> str:
    """Return data as JSON that no text can end early."""
    try:
        found = json.dumps(data, allow_nan=False, separators=(",", ":"))
    except ValueError:  # JSON has no infinity
        found = json.dumps(_finite(data), allow_nan=False, separators=(",", ":"))
    return found.replace("<", "\\u003c")


def _finite(data: Any) -> Any:
    """Return data with `None`, which is no point of a curve, in place of numbers that are not finite."""
    if isinstance(data, Mapping):
        return {key: _finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data


def _asset(name: str) -> str:
    """Return the text of a file in `assets/`."""
    return (files("hfsa.cosim.pages") / "assets" / name).read_text(encoding="utf-8")


@cache
def _plotly() -> str:
    """Return the library of interactive figures."""
    from plotly.offline import get_plotlyjs

    return get_plotlyjs()
