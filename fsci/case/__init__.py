"""Case files: reading, validation, located errors."""

from fsci.case.case import Case
from fsci.case.errors import CaseError
from fsci.case.load import load_case
