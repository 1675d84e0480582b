"""Sections are cut out of the text of a case by their keys."""

import pytest
from case_text import section, with_section, without

TEXT = """\
title: a case
fluid:
  grid: {cells: [1, 1]}
  bodies:
    ball:
      mesh: {shape: disc}
structure:
  bodies:
    beam: {}
# the end
output: {}
"""


def test_sections():
    assert section(TEXT, "title") == "title: a case\n"
    assert section(TEXT, "fluid", "bodies") == "  bodies:\n    ball:\n      mesh: {shape: disc}\n"
    assert section(TEXT, "structure", "bodies", "beam") == "    beam: {}\n"
    assert without(TEXT, "structure").endswith("mesh: {shape: disc}\n# the end\noutput: {}\n")
    assert "mesh" not in without(TEXT, "fluid", "bodies", "ball", "mesh")
    changed = with_section(TEXT, "  order: 2\n", "structure", "bodies")
    assert changed.endswith("structure:\n  order: 2\n# the end\noutput: {}\n")


@pytest.mark.parametrize("path", [("structure", "bodies", "mesh"), ("fluid", "beam"), ("nothing",)])
def test_a_section_that_is_not_there(path):
    with pytest.raises(KeyError, match=path[-1]):
        section(TEXT, *path)
