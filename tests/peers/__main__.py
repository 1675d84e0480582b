"""`python tests/peers FOLDER [NAME ..]`: install other programs if they are missing, run them, print tables."""

import sys

from run_peers import main

sys.exit(main(sys.argv[1:]))
