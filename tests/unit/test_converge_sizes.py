"""The size of a level whose sources have different ratios."""

import pytest

from fsci.converge.plan import PlannedRun
from fsci.converge.results import size_of
from fsci.twin.changes import Twin

RUN = PlannedRun(Twin("coarser_1.41", "", "space"), "level", {"cells": 1.2, "step": 1.5})


@pytest.mark.parametrize(
    ("parts", "size"),
    [
        ({"cells": 1.0, "step": 0.0}, 1.2),
        ({"cells": 0.0, "step": 3.0}, 1.5),
        ({"cells": 2.0, "step": 2.0}, ((1.44 + 2.25) / 2.0) ** 0.5),
        ({"cells": 0.0, "step": 0.0}, 1.8**0.5),
        ({"step": 1.0}, 1.8**0.5),
        ({}, 1.8**0.5),
    ],
)
def test_sources_count_by_their_errors(parts, size):
    assert size_of(RUN, parts) == pytest.approx(size)


def test_the_case_has_size_one():
    assert size_of(PlannedRun(Twin("case", "", "space"), "level"), {"cells": 1.0}) == 1.0
