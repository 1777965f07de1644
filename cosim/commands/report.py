"""Verb `report`: results files as one page that a colleague opens."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._json import Json
from hfsa.cosim.commands._options import Output


def report(
    files: Annotated[list[Path], Parameter(negative=())],
    /,
    *,
    title: str | None = None,
    output: Output = None,
    json: Json = False,
) -> int:
    """Write a page on results files: where they come from, interactive figures, and tables of what they found.

    Parameters
    ----------
    files
        Results files of any verb.
    title
        Title of the page (default: the titles of the files).
    output
        FILE.html (default: the first results file with the ending `.html`). An existing page of hfsa is replaced.
    """
    from hfsa.cosim.commands._report_parts import part_of, title_of
    from hfsa.cosim.pages.page import write_page
    from hfsa.cosim.pages.report_page import report_page
    from hfsa.cosim.results.target import check_page

    path = output or files[0].with_suffix(".html")
    check_page(path)
    page = report_page(title or title_of(files), [part_of(file) for file in files])
    write_page(path, page)
    _shell.answer({"page": path, "title": page.title, "files": files}, f"{page.title}\n{path}", json)
    return _shell.DONE
