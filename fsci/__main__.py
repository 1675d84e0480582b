"""`python -m fsci` is the program `fsci`."""

from fsci.cli import main

main()
