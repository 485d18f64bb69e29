"""Lines beside the results."""

from __future__ import annotations

import sys


def say(message: object) -> None:
    """One line on standard error."""
    print(f"quadcurv: {' '.join(str(message).split())}", file=sys.stderr)
