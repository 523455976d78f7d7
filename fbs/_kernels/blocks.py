"""Work cut into blocks that fit the cache and shared by the cores.

Where a block begins depends on the sizes alone, and inside one everything runs on one thread, so
that a result is the same, bit for bit, whatever the number of threads.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numpy as np

from .blas_threads import one_blas_thread

Task = TypeVar("Task")

SPAN = 2**14
"""Lines written in one go, at most: long runs cost half as much as short ones on fresh memory."""

WORTH_A_THREAD = 2**19
"""Bytes: to start a thread takes as long as to compute and write some 100 kB."""


KEPT = 2**25 - 2**16
"""Bytes: a little less than the largest mapping that glibc's malloc learns from."""


def keep_freed_memory() -> None:
    """Let the C library keep what is freed, up to 64 MB, for the next block of lines.

    As it starts, glibc's malloc maps every array of 128 kB and more anew and hands freed memory
    back: a page fault for each 4 kB, which takes as long as to compute them. It stops doing so for
    sizes that it has seen freed (mallopt(3), M_MMAP_THRESHOLD). The array here is never touched,
    so that it takes no memory itself; other libraries just allocate and free it.
    """
    np.empty(KEPT, dtype=np.uint8)


def cores() -> int:
    """Number of threads to use: OMP_NUM_THREADS, as for BLAS, else the cores of this process."""
    wanted = os.environ.get("OMP_NUM_THREADS", "")
    if wanted.isdecimal() and int(wanted) > 0:
        return int(wanted)
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def each(job: Callable[[Task], None], tasks: Iterable[Task], nbytes: int) -> None:
    """Do `job` for every task, on all cores; NumPy's loops and BLAS let go of the interpreter.

    Parameters
    ----------
    job : function of a task
    tasks : iterable
    nbytes : int
        What all of them write: below `WORTH_A_THREAD` per thread, fewer threads are started.
    """
    waiting = list(tasks)
    workers = min(cores(), len(waiting), nbytes // WORTH_A_THREAD)
    queue = iter(waiting)

    def work() -> None:
        for task in queue:
            job(task)

    with one_blas_thread():
        if workers < 2:
            work()
            return
        with ThreadPoolExecutor(workers - 1) as pool:
            others = [pool.submit(work) for _ in range(workers - 1)]
            work()
            for other in others:
                other.result()  # raises what a job raised


def stretches(size: int, step: int) -> Iterator[slice]:
    """Cut range(size) into slices of `step`, the last one shorter."""
    for start in range(0, size, step):
        yield slice(start, min(size, start + step))
