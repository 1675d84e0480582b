"""Families of peers.yaml: tables of what other programs give beside fsci."""

from __future__ import annotations

import sys
from pathlib import Path

from install import PeerMissing
from others import PeerFailed

from fsci.bench.family import read_families
from fsci.bench.table import show

PEERS = Path(__file__).with_name("peers.yaml")


def main(arguments: list[str]) -> int:
    """Exit code: 1 if a program is missing or fails, 2 for arguments that mean nothing."""
    families = read_families(PEERS)
    names = arguments[1:] or list(families)
    if not arguments or not set(names) <= families.keys():
        print(f"usage: python tests/peers FOLDER [{'|'.join(families)} ..]", file=sys.stderr)
        return 2
    folder, failed = Path(arguments[0]).resolve(), 0
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        print(f"\n{name}: {families[name].words}", flush=True)
        try:
            print(show(families[name].run(folder=folder)), flush=True)
        except (PeerMissing, PeerFailed) as error:
            print(error, flush=True)
            failed = 1
    return failed
