"""Problems in a case file, each with its line and column."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

SHOWN_WIDTH = 200  #: characters of a line that a message shows, those around the column


@dataclass(frozen=True)
class Place:
    """A line and column of the case file, or (without a line) an override of the command line."""

    source: str  #: path of the file as the user gave it, or `--set a.b=c`
    line: int = 0  #: from 1
    column: int = 0  #: from 1

    def __str__(self) -> str:
        return f"{self.source}:{self.line}:{self.column}" if self.line else self.source


@dataclass(frozen=True)
class Problem:
    """A mistake in a case file: position, message and lines."""

    place: Place
    message: str
    line: str = ""  #: the offending line of the file

    def __str__(self) -> str:
        message = self.message.replace("\n", " ")  # of a text quoted in it
        first = f"{self.place}: {message}"
        if not self.line:
            return first
        start = max(0, min(self.place.column - 1 - SHOWN_WIDTH // 2, len(self.line) - SHOWN_WIDTH))
        line, column = self.line[start : start + SHOWN_WIDTH], self.place.column - 1 - start
        # tabs before the caret stay tabs, so that it stands below its column
        before = "".join(c if c == "\t" else " " for c in line[:column])
        return f"{first}\n  {line}\n  {before.ljust(column)}^"


class CaseError(Exception):
    """A case that cannot be run; the text has all problems with their positions, sorted by line."""

    def __init__(self, problems: Iterable[Problem]):
        self.problems = tuple(sorted(problems, key=lambda p: (p.place.line, p.place.column)))
        super().__init__(self.problems)  # its only argument, so that it can be sent between processes

    def __str__(self) -> str:
        return "\n".join(str(problem) for problem in self.problems)


def did_you_mean(word: str, options: Iterable[str]) -> str:
    """The end of a message about an unknown word: the most similar option, or all options."""
    names = list(dict.fromkeys(options))
    lower = {name.lower(): name for name in names}
    if close := get_close_matches(word.lower(), lower, n=1):
        return f"; did you mean '{lower[close[0]]}'?"
    return f" (available: {', '.join(names) or 'none'})"


def listed(words: Sequence[str], last: str = "or") -> str:
    """'a', 'b' or 'c'."""
    quoted = [f"'{word}'" for word in words]
    return quoted[0] if len(quoted) == 1 else f"{', '.join(quoted[:-1])} {last} {quoted[-1]}"
