"""Expressions of x, y, z and t in case files: text to a function of arrays, through a small grammar, never `eval`.

    or     = and {"or" and}                 sum     = product {("+" | "-") product}
    and    = not {"and" not}                product = unary {("*" | "/") unary}
    not    = "not" not | chain              unary   = ("+" | "-") unary | power
    chain  = sum {("<" | "<=" | ...) sum}   power   = atom [("**" | "^") unary]
    atom   = number | name | name "(" or {"," or} ")" | "(" or ")"

Truth values are the numbers 1 and 0.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Values = Mapping[str, Any]  #: variable name -> number or array (n,)
Node = Callable[[Values], Any]  #: one evaluated part of the expression

VARIABLES = ("x", "y", "z", "t")
CONSTANTS = {"pi": np.float64(np.pi), "e": np.float64(np.e)}

#: name -> (fewest arguments, most arguments or None, function)
FUNCTIONS: dict[str, tuple[int, int | None, Callable[..., Any]]] = {
    "where": (3, 3, lambda condition, yes, no: np.where(np.not_equal(condition, 0), yes, no)),
    "min": (2, None, lambda *values: reduce(np.minimum, values)),
    "max": (2, None, lambda *values: reduce(np.maximum, values)),
    "atan2": (2, 2, np.arctan2),
    "abs": (1, 1, np.abs),
    "sign": (1, 1, np.sign),
    "sqrt": (1, 1, np.sqrt),
    "exp": (1, 1, np.exp),
    "log": (1, 1, np.log),
    "log10": (1, 1, np.log10),
    "sin": (1, 1, np.sin),
    "cos": (1, 1, np.cos),
    "tan": (1, 1, np.tan),
    "asin": (1, 1, np.arcsin),
    "acos": (1, 1, np.arccos),
    "atan": (1, 1, np.arctan),
    "sinh": (1, 1, np.sinh),
    "cosh": (1, 1, np.cosh),
    "tanh": (1, 1, np.tanh),
    "floor": (1, 1, np.floor),
    "ceil": (1, 1, np.ceil),
    "ramp": (3, 3, lambda x, start, end: _rise((x - start) / (end - start))),
}
COMPARISONS: dict[str, Callable[[Any, Any], Any]] = {
    "<": np.less,
    "<=": np.less_equal,
    ">": np.greater,
    ">=": np.greater_equal,
    "==": np.equal,
    "!=": np.not_equal,
}
KEYWORDS = ("and", "or", "not")
#: Names that functions of the user cannot have.
RESERVED_WORDS = frozenset((*VARIABLES, *CONSTANTS, *FUNCTIONS, *KEYWORDS))
FORMULA_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<name>[A-Za-z_][A-Za-z_0-9]*)"
    r"|(?P<sign>\*\*|<=|>=|==|!=|[-+*/^<>(),])"
    r"|(?P<wrong>\S))"
)


def _rise(s: Any) -> Any:
    """From 0 to 1 between s = 0 and 1, the first two derivatives being zero at both ends."""
    s = np.clip(s, 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


class ExpressionError(ValueError):
    """The text is not an expression; `column` counts its characters from 1."""

    def __init__(self, message: str, column: int):
        super().__init__(message)
        self.message, self.column = message, column


@dataclass(frozen=True)
class Miss:
    """A point and a time at which an expression has no finite value."""

    value: float  #: infinite or not a number
    t: float  #: [s]
    x: tuple[float, ...]  #: [m]


@dataclass(frozen=True)
class Expression:
    """A formula of x, y, z and t that can be evaluated at many points at once."""

    text: str
    uses: frozenset[str]  #: the variables it contains
    _value: Node = field(repr=False, compare=False)
    _missed: list[Miss] = field(default_factory=list, repr=False, compare=False)

    @staticmethod
    def parse(text: str | float, functions: Mapping[str, Callable[..., Any]] | None = None) -> Expression:
        """Read text (or a number) that may call `functions` of one argument too; raises ExpressionError."""
        return _Parser(str(text), functions or {}).expression()

    @property
    def missed(self) -> Miss | None:
        """The latest call that gave no finite value, or None."""
        return self._missed[0] if self._missed else None

    @property
    def constant(self) -> float | None:
        """Its value if it contains no variable, else None."""
        return None if self.uses else self._evaluate({})

    def __call__(self, x: ArrayLike, t: float) -> Array:
        """Values (n,) at the points x of shape (dim, n) and the time t; z is 0 in 2D."""
        x = np.asarray(x, dtype=float)
        places = (*x, *[np.zeros(x.shape[1])] * (3 - len(x)))
        value = self._evaluate(dict(zip(VARIABLES, (*places, np.float64(t)), strict=True)))
        result = np.array(np.broadcast_to(value, x.shape[1:]), dtype=float)
        if not np.isfinite(result).all():
            first = int(np.flatnonzero(~np.isfinite(result))[0])
            self._missed[:] = [Miss(float(result[first]), float(t), tuple(x[:, first].tolist()))]
        return result

    def at_times(self, t: ArrayLike, x: Sequence[float] = ()) -> Array:
        """Values at a point x [m] and the times t, of the shape of t; without a point of a formula of t alone."""
        t = np.asarray(t, dtype=float)
        return np.array(np.broadcast_to(self._evaluate({"t": t, **dict(zip("xyz", x, strict=False))}), t.shape), float)

    def _evaluate(self, values: Values) -> Any:
        # The branch that `where` does not take may divide by zero.
        with np.errstate(all="ignore"):
            return self._value(values)


class _Parser:
    """Recursive descent over the tokens of one text."""

    def __init__(self, text: str, functions: Mapping[str, Callable[..., Any]]):
        self.text = text
        self.functions = FUNCTIONS | {name: (1, 1, function) for name, function in functions.items()}
        self.uses: set[str] = set()
        self.tokens: list[tuple[str, str, int]] = []  # kind, text, column
        for match in FORMULA_TOKEN.finditer(text):
            kind = match.lastgroup or "wrong"
            self.tokens.append((kind, match[kind], match.start(kind) + 1))
        self.tokens.append(("end", "", len(text.rstrip()) + 1))
        self.at = 0

    def expression(self) -> Expression:
        try:
            value = self.disjunction()
            if self.kind != "end":
                raise self.unexpected("an operator such as + or *")
            result = Expression(self.text, frozenset(self.uses), value)
            if result.constant is not None and not np.isfinite(result.constant):
                raise ExpressionError(f"'{self.text}' has no finite value", 1)
        except RecursionError:
            raise ExpressionError("the expression is nested too deeply", 1) from None
        return result

    @property
    def kind(self) -> str:
        return self.tokens[self.at][0]

    @property
    def word(self) -> str:
        return self.tokens[self.at][1]

    @property
    def column(self) -> int:
        return self.tokens[self.at][2]

    def take(self, *words: str) -> str:
        """The current token if it is one of these (then move on), else empty."""
        word = self.word
        if self.kind not in ("sign", "name") or word not in words:
            return ""
        self.at += 1
        return word

    def unexpected(self, wanted: str) -> ExpressionError:
        found = "the expression ends" if self.kind == "end" else f"found '{self.word}'"
        hint = " ('==' compares)" if self.word == "=" else ""
        return ExpressionError(f"{found} where {wanted} is expected{hint}", self.column)

    def disjunction(self) -> Node:
        parts = [self.conjunction()]
        while self.take("or"):
            parts.append(self.conjunction())
        return parts[0] if len(parts) == 1 else lambda v: 1.0 * reduce(np.logical_or, [p(v) for p in parts])

    def conjunction(self) -> Node:
        parts = [self.negation()]
        while self.take("and"):
            parts.append(self.negation())
        return parts[0] if len(parts) == 1 else lambda v: 1.0 * reduce(np.logical_and, [p(v) for p in parts])

    def negation(self) -> Node:
        if self.take("not"):
            inner = self.negation()
            return lambda v: 1.0 * np.logical_not(inner(v))
        return self.chain()

    def chain(self) -> Node:
        parts, comparisons = [self.sum()], []
        while sign := self.take(*COMPARISONS):
            comparisons.append(COMPARISONS[sign])
            parts.append(self.sum())
        if not comparisons:
            return parts[0]

        def value(v: Values) -> Any:
            values = [part(v) for part in parts]
            holds = [compare(values[i], values[i + 1]) for i, compare in enumerate(comparisons)]
            return 1.0 * reduce(np.logical_and, holds)

        return value

    def sum(self) -> Node:
        return self.row(self.product, {"+": np.add, "-": np.subtract})

    def product(self) -> Node:
        return self.row(self.unary, {"*": np.multiply, "/": np.divide})

    def row(self, part: Callable[[], Node], signs: dict[str, Callable[[Any, Any], Any]]) -> Node:
        """Parts joined from left to right; a loop, so that long sums do not nest."""
        first, rest = part(), []
        while sign := self.take(*signs):
            rest.append((signs[sign], part()))

        def value(v: Values) -> Any:
            result = first(v)
            for join, node in rest:
                result = join(result, node(v))
            return result

        return value if rest else first

    def unary(self) -> Node:
        if sign := self.take("+", "-"):
            inner = self.unary()
            return inner if sign == "+" else lambda v: np.negative(inner(v))
        return self.power()

    def power(self) -> Node:
        base = self.atom()
        if self.take("**", "^"):
            exponent = self.unary()
            return lambda v: np.power(base(v), exponent(v))
        return base

    def atom(self) -> Node:
        kind, word, column = self.tokens[self.at]
        if self.take("("):
            inner = self.disjunction()
            self.close()
            return inner
        if kind == "number":
            self.at += 1
            number = np.float64(word)
            return lambda v: number
        if kind == "name" and word not in KEYWORDS:
            self.at += 1
            return self.call(word, column) if self.take("(") else self.name(word, column)
        raise self.unexpected("a number, a name or '('")

    def close(self) -> None:
        if not self.take(")"):
            raise self.unexpected("')'")

    def name(self, word: str, column: int) -> Node:
        if word in VARIABLES:
            self.uses.add(word)
            return lambda v: v[word]
        if word in CONSTANTS:
            return lambda v: CONSTANTS[word]
        if word in self.functions:
            raise ExpressionError(f"'{word}' is a function: write {word}(...)", column)
        raise _unknown(word, column, "name", [*VARIABLES, *CONSTANTS, *self.functions])

    def call(self, word: str, column: int) -> Node:
        if word not in self.functions:
            if word in VARIABLES or word in CONSTANTS:
                raise ExpressionError(f"'{word}' is not a function; write '{word}*(' to multiply", column)
            raise _unknown(word, column, "function", list(self.functions))
        arguments = [self.disjunction()]
        while self.take(","):
            arguments.append(self.disjunction())
        self.close()
        fewest, most, function = self.functions[word]
        if len(arguments) < fewest or (most is not None and len(arguments) > most):
            wanted = f"{fewest} argument" + "s" * (fewest > 1) if most else f"at least {fewest} arguments"
            raise ExpressionError(f"'{word}' takes {wanted}, not {len(arguments)}", column)
        return lambda v: function(*[argument(v) for argument in arguments])


def _unknown(word: str, column: int, kind: str, names: list[str]) -> ExpressionError:
    close = get_close_matches(word, names, n=1)
    known = ", ".join(name for name in names if name not in FUNCTIONS) or ", ".join(names)
    hint = f"; did you mean '{close[0]}'?" if close else f" (known: {known})"
    return ExpressionError(f"unknown {kind} '{word}'{hint}", column)
