"""The command line: compare, curvature, view."""

from __future__ import annotations

import itertools
import logging
import sys
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from cyclopts import App, CycloptsError

import quadcurv
from quadcurv.cli.commands import compare, curvature, view
from quadcurv.cli.say import say
from quadcurv.viewing import NoOpenGLError

__all__ = ["app", "main"]

app = App(
    name="quadcurv",
    help="Mean curvature on quad meshes, with every operator side by side.",
    help_format="markdown",
    help_epilogue="`quadcurv COMMAND --help` shows examples of each.",
    version=quadcurv.__version__,
)
for _command in (compare, curvature, view):
    app.command(_command)
app.register_install_completion_command(help="Install completion for this shell.")


def main(arguments: Iterable[str] | None = None) -> None:
    """Run the command line; what is wrong with the input takes one line and exit code 2."""
    tokens = list(sys.argv[1:] if arguments is None else arguments)
    with warnings.catch_warnings(), _log_said():
        warnings.simplefilter("default", UserWarning)
        warnings.showwarning = lambda message, *_: say(f"warning: {message}")
        try:
            app(_with_values(tokens), exit_on_error=False, print_error=False)
        except BrokenPipeError:  # the reader, such as head, has seen enough
            sys.stderr.close()
            raise SystemExit(0) from None
        except KeyboardInterrupt:
            raise SystemExit(130) from None
        except MemoryError:
            say("not enough memory")
            raise SystemExit(2) from None
        except (CycloptsError, ImportError, NoOpenGLError, OSError, TypeError, ValueError) as error:
            say(_message(error))
            raise SystemExit(2) from None


def _with_values(tokens: list[str]) -> list[str]:
    """The tokens, a --merge that no length follows standing for itself, wherever the file's name stands."""
    return [
        "--merge=true" if token == "--merge" and not _is_number(following) else token
        for token, following in itertools.zip_longest(tokens, tokens[1:], fillvalue="")
    ]


def _is_number(token: str) -> bool:
    try:
        float(token)
    except ValueError:
        return False
    return True


@contextmanager
def _log_said() -> Iterator[None]:
    """What the package logs, such as that it compiles for the first time, on standard error."""
    logger = logging.getLogger("quadcurv")
    handler = logging.Handler(logging.INFO)
    handler.emit = lambda record: say(record.getMessage())  # type: ignore[method-assign]
    level = logger.level
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.setLevel(level)


def _message(error: BaseException) -> str:
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return str(error)
