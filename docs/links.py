"""Checks that every internal link of the built site, and of the Markdown files at the root, leads somewhere.

    python docs/links.py docs/_build

Pages and anchors are looked up in the files; links to other sites are not followed.
"""

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote, urlsplit

from lxml import html

ROOT = Path(__file__).resolve().parents[1]
MARKDOWN = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "fmus/README.md")
_LINK = re.compile(r"\]\(([^)\s]+)\)")
_FENCE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)


def broken_in_site(site: Path) -> Iterator[str]:
    """Yield a line for each link of the site whose page, file or anchor does not exist."""
    pages = {file: html.parse(str(file)).getroot() for file in sorted(site.rglob("*.html"))}
    anchors = {file.resolve(): {*page.xpath("//@id"), *page.xpath("//a/@name")} for file, page in pages.items()}
    for file, page in pages.items():
        for link in page.xpath("//a/@href | //img/@src | //link/@href | //script/@src"):
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (file.parent / unquote(parts.path)).resolve() if parts.path else file.resolve()
            if target.is_dir():
                target /= "index.html"
            if not target.exists():
                yield f"{file.relative_to(site)}: {link}: no such page"
            elif parts.fragment and target in anchors and unquote(parts.fragment) not in anchors[target]:
                yield f"{file.relative_to(site)}: {link}: no such anchor"


def broken_in_markdown() -> Iterator[str]:
    """Yield a line for each relative link of the Markdown files at the root that leads nowhere."""
    for name in MARKDOWN:
        file = ROOT / name
        for link in _LINK.findall(_FENCE.sub("", file.read_text(encoding="utf-8"))):
            parts = urlsplit(link)
            if not parts.scheme and parts.path and not (file.parent / unquote(parts.path)).exists():
                yield f"{name}: {link}: no such file"


def main(site: Path) -> int:
    """Print broken links; 1 where there are any."""
    broken = [*broken_in_site(site), *broken_in_markdown()]
    print(*broken, sep="\n", end="\n" if broken else "")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
