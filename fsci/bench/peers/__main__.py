"""`python -m fsci.bench.peers FOLDER [stokes|cylinder|hertz|fsi1 ..]`: install what is missing, run, print tables."""

from __future__ import annotations

import sys
from pathlib import Path

from fsci.bench.peers.install import PeerMissing
from fsci.bench.peers.rows import ROWS, PeerFailed
from fsci.bench.table import show


def main(arguments: list[str]) -> int:
    """Exit code: 1 if a program is missing or fails, 2 for arguments that mean nothing."""
    names = arguments[1:] or list(ROWS)
    if not arguments or not set(names) <= set(ROWS):
        print(f"usage: python -m fsci.bench.peers FOLDER [{'|'.join(ROWS)} ..]", file=sys.stderr)
        return 2
    folder, failed = Path(arguments[0]).resolve(), 0
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        print(f"\n{name}: {(ROWS[name].__doc__ or '').splitlines()[0]}", flush=True)
        try:
            print(show(ROWS[name](folder)), flush=True)
        except (PeerMissing, PeerFailed) as error:
            print(error, flush=True)
            failed = 1
    return failed


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
