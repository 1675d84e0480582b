"""The failure of a step in which a body has passed a wall."""

from solvers.api import StepFailed


class WallPassed(StepFailed):
    """A body has passed a wall within a step, faster than it was before: the step has to be taken with contact."""
