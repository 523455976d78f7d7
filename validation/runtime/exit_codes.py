"""How a command line ends: an exit code, and one message on standard error where it fails.

Commands themselves end with 0 (agreed or done) or 1 (a disagreement). Whatever else happens must
never look like one of these.
"""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Sequence
from typing import Any, cast

import typer

from ..errors import CommandError
from .interruption import Interrupted, every_interrupt, on_interrupt

PROGRAM = "crosscheck"
BAD_INPUT = 2
FAULT = 70  # EX_SOFTWARE of sysexits.h
INTERRUPTED, READER_GONE = 130, 141  # as shells say it: 128 + SIGINT, 128 + SIGPIPE

# What typer raises of a command line it cannot read; it exports this class of them only.
USAGE_ERROR = cast("type[Exception]", typer.BadParameter.__bases__[0])


def exit_code(app: typer.Typer, arguments: Sequence[str]) -> int:
    """Run a command line; what it raises becomes a message and an exit code."""
    try:
        with on_interrupt("no file was left half written"), every_interrupt():
            code = _invoke(app, arguments)
            sys.stdout.flush()
    except USAGE_ERROR as error:
        return _told(BAD_INPUT, usage_message(error, arguments))
    except Interrupted as interrupt:
        return _told(INTERRUPTED, f"{PROGRAM}: interrupted; {interrupt}")
    except BrokenPipeError:
        return _reader_gone()
    except SystemExit as error:  # no command ends so; rich does, with 1, where nobody reads on
        return _reader_gone() if isinstance(error.__context__, BrokenPipeError) else _fault(error)
    except input_errors() as error:
        return _told(BAD_INPUT, f"{PROGRAM}: {error}")
    except MemoryError as error:
        why = f" ({error})" if str(error) else ""
        return _told(
            BAD_INPUT,
            f"{PROGRAM}: not enough memory{why}; give a larger --df, a narrower band or fewer DoFs",
        )
    except Exception as error:  # whatever else there is, named as ours
        return _fault(error)
    return code


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


def _told(code: int, message: str) -> int:
    print(message, file=sys.stderr)
    return code


def _fault(error: BaseException) -> int:
    message = (
        f"{PROGRAM}: a fault of {PROGRAM} itself, not of its input ({type(error).__name__}); "
        "please report it with what follows"
    )
    return _told(FAULT, f"{message}\n{''.join(traceback.format_exception(error))}".rstrip())


def _reader_gone() -> int:
    """Nobody reads on, as `| head` does: what is still to be written goes nowhere."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return READER_GONE
