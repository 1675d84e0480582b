"""The segment between two coupling iterates with different contact."""

import numpy as np

from coupling.bracket import CouplingIterate, brackets, halved


def iterate(d: float, found: float, touching: bool | None = False) -> CouplingIterate:
    nodes = None if touching is None else np.array([touching])
    return CouplingIterate(np.array([[0.0, d]]), np.array([[0.0, found]]), nodes)


def test_only_opposite_residuals_and_different_contact_bracket():
    """Where the residuals point away from each other, or contact is the same, there is no root to be found."""
    closed, opened = iterate(0.0, 1.0), iterate(0.5, 0.0, True)
    assert brackets(closed, opened)
    assert brackets(opened, closed)
    assert not brackets(closed, iterate(0.5, 0.7, True))
    assert not brackets(closed, iterate(0.5, 0.0))
    assert not brackets(iterate(0.0, 1.0, None), iterate(0.5, 0.0, None))
    assert not brackets(iterate(0.0, -1.0), iterate(0.5, 1.0, True))


def test_halves_end_where_contact_is_the_same():
    """D(d) = 0.1 - 4 (d - 0.01) as long as it is positive, else 0 in contact: the root is 0.028."""

    def evaluate(d: float) -> CouplingIterate:
        found = max(0.0, 0.1 - 4.0 * (d - 0.01))
        return iterate(d, found, found == 0.0)

    ends = evaluate(0.0), evaluate(0.5)
    assert brackets(*ends)
    for _ in range(40):
        if ends[0].same_contact(ends[1]):
            break
        ends = halved(*ends, evaluate(0.5 * (ends[0].d + ends[1].d)[0, 1]))
    low, high = sorted(float(end.d[0, 1]) for end in ends)
    assert low < 0.028 < high < 0.035
    assert not any(end.touching[0] for end in ends)
