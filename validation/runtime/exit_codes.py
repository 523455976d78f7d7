"""How a command line ends: an exit code, and one message on standard error where it fails.

Commands themselves end with 0 (agreed or done) or 1 (a disagreement). Whatever else happens must
never look like one of these.
"""

from __future__ import annotations

import errno
import os
import sys
import traceback
from collections.abc import Sequence
from typing import Any, cast

import typer

from ..errors import CommandError, ill_conditioned
from .interruption import Interrupted, every_interrupt, on_interrupt
from .streams import message, prepare_streams, tell, to_nowhere

PROGRAM = "crosscheck"
BAD_INPUT = 2
FAULT = 70  # EX_SOFTWARE of sysexits.h
OF_STREAMS = (errno.ENOSPC, errno.EFBIG, errno.EIO, errno.EBADF)  # without the name of a file
INTERRUPTED, READER_GONE = 130, 141  # as shells say it: 128 + SIGINT, 128 + SIGPIPE

# What typer raises of a command line it cannot read; it exports this class of them only.
USAGE_ERROR = cast("type[Exception]", typer.BadParameter.__bases__[0])


def exit_code(app: typer.Typer, arguments: Sequence[str]) -> int:
    """Run a command line; what it raises becomes a message and an exit code."""
    prepare_streams()
    os.environ["MPLBACKEND"] = "agg"  # whatever it was: no window is opened, and a wrong name fails
    try:
        code = _ended(app, arguments)
        sys.stdout.flush()
    except BrokenPipeError:
        to_nowhere(sys.stdout)
        return READER_GONE
    except OSError as error:
        to_nowhere(sys.stdout)
        return _told(BAD_INPUT, f"standard output: cannot be written: {error.strerror or error}")
    return code


def _ended(app: typer.Typer, arguments: Sequence[str]) -> int:
    try:
        with on_interrupt("no file was left half written"), every_interrupt():
            return _invoke(app, arguments)
    except USAGE_ERROR as error:
        tell(message(usage_message(error, arguments)))
        return BAD_INPUT
    except Interrupted as interrupt:
        # Python keeps in mind that an interrupt left an exec(), such as that of a dataclass which
        # is being made, and lets `python -m` end by the signal at last; the next exec() forgets it
        exec("")
        return _told(INTERRUPTED, f"interrupted; {interrupt}")
    except BrokenPipeError:
        raise
    except SystemExit as error:  # no command ends so; rich does, with 1, where nobody reads on
        if isinstance(error.__context__, BrokenPipeError):
            raise error.__context__ from None
        return _fault(error)
    except input_errors() as error:
        return _told(BAD_INPUT, str(error))
    except linear_algebra_errors() as error:
        return _told(BAD_INPUT, str(ill_conditioned("the model", error)))
    except OSError as error:  # the machine's: a disk, a limit, a stream
        sys.stdout.flush()  # raises if it is still that one
        where = error.filename or ("standard output" if error.errno in OF_STREAMS else "")
        return _told(BAD_INPUT, f"{where}{': ' * bool(where)}{error.strerror or error}")
    except MemoryError as error:
        why = f" ({error})" if str(error) else ""
        return _told(
            BAD_INPUT,
            f"not enough memory{why}; ask for less: fewer lines, DoFs, samples or processes",
        )
    except Exception as error:  # whatever else there is, named as ours
        return _fault(error)


def _invoke(app: typer.Typer, arguments: Sequence[str]) -> int:
    """Run it as typer would, which makes 130 of an interruption and 1 of a reader gone."""
    command = typer.main.get_command(app)
    try:
        with command.make_context(PROGRAM, list(arguments)) as context:
            command.invoke(context)
    except typer.Exit as done:
        return done.exit_code
    return 0


def input_errors() -> tuple[type[ValueError], ...]:
    """What bad input raises; looked up when something is raised, since fbs takes time to load."""
    from fbs.errors import FbsError
    from mbs_models.errors import ModelError

    return ModelError, FbsError, CommandError


def linear_algebra_errors() -> type[ValueError]:
    """What LAPACK's wrappers raise; looked up late, as above."""
    from numpy.linalg import LinAlgError

    return LinAlgError


def usage_message(error: Any, arguments: Sequence[str]) -> str:
    """One line on a command line that typer cannot read: command, option, value, what is allowed.

    Parameters
    ----------
    error
        A `USAGE_ERROR`, with the parameter concerned if there is one.
    arguments
        The command line: typer does not say the value.
    """
    known = getattr(error, "ctx", None)
    command = known.command_path if known else " ".join((PROGRAM, *arguments[:1]))
    parameter, reason = getattr(error, "param", None), " ".join(error.message.split()).rstrip(".")
    if parameter is None or not reason:
        reason = " ".join(error.format_message().split()).rstrip(".")
        return f"{command}: {reason[:1].lower()}{reason[1:]} (see {command} --help)"
    # "Input should be a valid number, unable to parse string as a number"
    reason = reason.partition(", unable to parse")[0].replace("Input should be", "must be")
    value = _value(parameter.opts, arguments)
    name = parameter.metavar if parameter.param_type_name == "argument" else parameter.opts[0]
    return f"{command}: {name}{'' if value is None else f' = {value!r}'}: {reason}"


def _value(options: Sequence[str], arguments: Sequence[str]) -> str | None:
    """The last value of an option, which is the one that counts."""
    for argument, following in zip(arguments[::-1], (None, *arguments[:0:-1]), strict=True):
        name, sign, value = argument.partition("=")
        if name in options:
            return value if sign else following
    return None


def _told(code: int, text: str) -> int:
    tell(message(f"{PROGRAM}: {text}"))
    return code


def _fault(error: BaseException) -> int:
    tell(
        f"{PROGRAM}: a fault of {PROGRAM} itself, not of its input ({type(error).__name__}); "
        f"please report it with what follows\n{''.join(traceback.format_exception(error))}".rstrip()
    )
    return FAULT
