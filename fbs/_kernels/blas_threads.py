"""Keeping BLAS and LAPACK from starting threads that cost more than they give."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, field
from functools import cache
from threading import Lock
from typing import Any

SMALL = 256
"""Order of a matrix whose eigensolution two threads of LAPACK do not make faster."""


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Keep BLAS to the thread that calls it, here and in all threads, until the block ends.

    A thread of OpenBLAS that has done its part spins for some 20 ms, waiting for more, on the core
    that another thread needs: the modes of 30 DoFs then take a hundred times as long.
    """
    threads = _blas_threads()
    threads.hold()
    try:
        yield
    finally:
        threads.release()


def blas_for(order: int) -> AbstractContextManager[None]:
    """Keep BLAS to one thread for matrices of this order, unless it is large."""
    return one_blas_thread() if order <= SMALL else nullcontext()


@dataclass
class _BlasThreads:
    """The limit on BLAS's threads, lifted when the last of those who hold it lets go."""

    holders: int = 0
    limit: Any = None
    lock: Lock = field(default_factory=Lock)

    def hold(self) -> None:
        with self.lock:
            if not self.holders:
                self.limit = _controller("scipy.linalg" in sys.modules).limit(limits=1)
            self.holders += 1

    def release(self) -> None:
        with self.lock:
            self.holders -= 1
            if not self.holders:
                self.limit.restore_original_limits()


@cache
def _blas_threads() -> _BlasThreads:
    return _BlasThreads()


@cache
def _controller(with_scipy: bool) -> Any:
    """Find the BLAS libraries loaded: NumPy's, and SciPy's own once that is imported."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController().select(user_api="blas")
