"""Work in pieces on any executor; pieces of lost workers are computed again."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future
from dataclasses import dataclass
from itertools import islice
from queue import Empty, SimpleQueue
from typing import Any, Generic, TypeVar

from ..errors import CommandError
from .executors import Workers, process_pool
from .interruption import interrupts_later

Item = TypeVar("Item")
Result = TypeVar("Result")

IN_FLIGHT = 64  # pieces handed out at a time, at least, so that results never pile up
POLL = 10.0  # seconds without a result until an executor is asked whether it is still there


@dataclass(frozen=True)
class Work(Generic[Item, Result]):
    """What is done to a piece, a few items.

    Attributes
    ----------
    evaluate
        Items → their result; sent to other processes, so that it must pickle.
    joined
        Results of some items, one after the other, as one.
    failed
        The result of an item that could not be computed, and why.
    noun
        What the items are, in the plural.
    """

    evaluate: Callable[[tuple[Item, ...]], Result]
    joined: Callable[[Sequence[Result]], Result]
    failed: Callable[[Item, str], Result]
    noun: str


def computed(
    work: Work[Item, Result],
    pieces: Mapping[str, tuple[Item, ...]],
    workers: Workers,
    warn: Callable[[str], None],
) -> Iterator[tuple[str, Result]]:
    """The result of every piece by its key, as they come.

    Pieces of a worker that dies are computed again, in a process of their own; an item that kills
    that, too, has failed.

    Parameters
    ----------
    work, pieces
        What is done, to what.
    workers
        Around any `concurrent.futures` executor; none: one piece after the other, here.
    warn
        Told of lost workers.

    Raises
    ------
    CommandError
        Worker processes die before they compute anything.
    """
    executor = workers.executor
    if executor is None:
        for key, items in pieces.items():
            yield key, work.evaluate(items)
        return
    in_flight = max(IN_FLIGHT, 4 * workers.count)
    waiting = iter(pieces.items())
    running: dict[Future[Result], str] = {}
    done: SimpleQueue[Future[Result]] = SimpleQueue()
    lost: dict[str, str] = {}  # and why
    while True:
        for key, items in islice(waiting, in_flight - len(running)):
            try:
                running[_submitted(executor, done, work.evaluate, items)] = key
            except BrokenExecutor as error:
                lost[key] = _reason(error)
        if not running:
            break
        try:
            future = done.get(timeout=POLL)
        except Empty:
            if why := workers.gone():
                lost |= dict.fromkeys(running.values(), why)
                break
            continue
        key = running.pop(future)
        try:
            result = future.result()
        except Exception as error:  # each executor has its own for a worker that is gone
            # what is wrong with the items themselves shows again below
            lost[key] = _reason(error)
            continue
        yield key, result
    if lost:
        reason = next(iter(lost.values()))
        again = {key: pieces[key] for key in (*lost, *(key for key, _ in waiting))}
        n = sum(map(len, again.values()))
        warn(f"{n} {work.noun} were lost with their workers and are computed again: {reason}")
        yield from _again(work, again)


def _submitted(
    executor: Executor,
    done: SimpleQueue[Future[Result]],
    function: Callable[..., Result],
    *arguments: Any,
) -> Future[Result]:
    """A call, which comes to a queue when it is done.

    An interrupt may end the waiting for a queue of this kind, but not that for a future: it may
    leave the lock taken that the executor needs to end.
    """
    with interrupts_later():
        future = executor.submit(function, *arguments)
        future.add_done_callback(done.put)
    return future


def _waited(executor: Executor, function: Callable[..., Result], *arguments: Any) -> Result:
    """The result of one call."""
    done: SimpleQueue[Future[Result]] = SimpleQueue()
    _submitted(executor, done, function, *arguments)
    return done.get().result()


def _reason(error: Exception) -> str:
    first, *_ = str(error).splitlines() or [""]
    return f"{type(error).__name__} {first}".strip()


def _again(
    work: Work[Item, Result], pieces: Mapping[str, tuple[Item, ...]]
) -> Iterator[tuple[str, Result]]:
    """Pieces in a process beside this one, item by item if it dies of them."""
    waiting = list(pieces.items())
    while waiting:
        with process_pool(1, apart=True) as workers:
            assert workers.executor is not None
            _require_start(workers.executor)
            while waiting:
                key, items = waiting.pop(0)
                try:
                    piece = _waited(workers.executor, work.evaluate, items)
                except BrokenExecutor:
                    yield key, work.joined([_alone(work, item) for item in items])
                    break
                yield key, piece


def _require_start(executor: Executor) -> None:
    """Tell processes that die of their items from those that never begin."""
    try:
        _waited(executor, int)
    except BrokenExecutor as error:
        raise CommandError(
            "worker processes die as they start; a script that computes with processes needs its "
            "work under `if __name__ == '__main__':`"
        ) from error


def _alone(work: Work[Item, Result], item: Item) -> Result:
    """One item in a process of its own."""
    with process_pool(1, apart=True) as workers:
        assert workers.executor is not None
        try:
            return _waited(workers.executor, work.evaluate, (item,))
        except BrokenExecutor:
            return work.failed(item, "the process that computed it died")
