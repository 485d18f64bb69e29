"""``python -m quadcurv``: the command line."""

from quadcurv.cli import main

main()
