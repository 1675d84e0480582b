"""Files that a user names: plain ones of bounded size, no folders, devices or pipes, which may never end."""

from __future__ import annotations

from pathlib import Path


class Unreadable(Exception):
    """The message says what is wrong with the file."""


def read_file(path: Path, most: int) -> bytes:
    """The content of a file of at most so many bytes. Raises Unreadable."""
    try:
        if path.exists() and not path.is_file():
            raise Unreadable("is not a file")
        with path.open("rb") as file:
            content = file.read(most + 1)
    except (OSError, ValueError) as error:  # ValueError: a name with a zero byte
        raise Unreadable(f"cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if len(content) > most:
        raise Unreadable(f"is larger than {most / 1e6:g} MB")
    return content
