"""Run several commands of `fsci` one after the other: a start of Python and MPI costs as much as a short run.

Usage: run_cases.py COMMANDS, a JSON file with a list of argument lists. Ends with the first exit code that is not 0.
"""

import json
import sys
from pathlib import Path

from fsci.cli import execute

for arguments in json.loads(Path(sys.argv[1]).read_text()):
    print("fsci", *arguments, flush=True)
    if code := execute(arguments):
        sys.exit(code)
