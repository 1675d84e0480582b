"""The predicted place of a body: exact for motions that are parabolas in time, whatever the steps."""

import numpy as np
import pytest

from coupling.predict import Predictor


def parabola(t: float) -> np.ndarray:
    return np.array([[1.0 + 2.0 * t - 3.0 * t**2, 0.5 * t**2]])


@pytest.mark.parametrize(("displacements", "order"), [(1, 0), (2, 1), (3, 2)])
def test_follows_polynomials_of_the_order_it_knows(displacements: int, order: int) -> None:
    predictor = Predictor()
    times = [0.0, 0.1, 0.25][:displacements]
    for t in times:
        predictor.add(t, np.array([[t**order, 2.0 * t**order]]))
    assert predictor.at(0.4) == pytest.approx(np.array([[0.4**order, 2.0 * 0.4**order]]), rel=1e-13)


def test_forgets_what_is_older_than_three_displacements() -> None:
    predictor = Predictor()
    predictor.add(-5.0, np.array([[1e6, -1e6]]))
    for t in (0.0, 0.1, 0.15):
        predictor.add(t, parabola(t))
    assert predictor.at(0.2) == pytest.approx(parabola(0.2), rel=1e-13)
