"""Text from files made safe: a mission file must not be able to steer a terminal or break JSON."""

from __future__ import annotations


def printable(text: str) -> str:
    """Return the text on one line, with everything that cannot be printed written as an escape."""
    if text.isprintable():
        return text
    return "".join(
        character if character.isprintable() else character.encode("unicode_escape").decode("ascii")
        for character in text
    )


def well_formed(text: str) -> str:
    """Return the text with lone surrogates, which no encoding takes, shown as ``�``.

    They come from file names that are no UTF-8 and from careless JSON.
    """
    if text.isascii():
        return text
    return "".join(
        "\N{REPLACEMENT CHARACTER}" if "\ud800" <= character <= "\udfff" else character
        for character in text
    )
