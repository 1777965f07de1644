"""Verb `list`: components, controllers and scenes."""

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._json import Json


def list(name: str | None = None, /, *, json: Json = False) -> int:  # noqa: A001 (name of the verb)
    """List components with their levels and ports, controllers, and scenes.

    Parameters
    ----------
    name
        Part or scene to show in full, with its arguments and parameters; or the path of a file, of a folder of them, or
        of an FMU of any maker.
    """
    if name is None:
        from hfsa.cosim.commands._whole_listing import whole_listing

        _shell.answer(*whole_listing(), json)
    else:
        from hfsa.cosim.commands._listing import listing, listing_text

        data = listing(name)
        _shell.answer(data, listing_text(data), json)
    return _shell.DONE
