"""Rows in parallel: kernels that release the GIL, run over ranges of rows by a few Python threads."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait

import numba

CHUNKS_PER_THREAD = 8  # rows differ in cost: small chunks, taken one by one, keep all threads busy to the end

_pool: ThreadPoolExecutor | None = None
_pool_lock = threading.Lock()


def _shared_pool() -> ThreadPoolExecutor:
    global _pool
    with _pool_lock:
        if _pool is None:
            _pool = ThreadPoolExecutor(max(1, numba.config.NUMBA_NUM_THREADS - 1), "autostereo")
        return _pool


def _forget_pool() -> None:
    global _pool, _pool_lock
    _pool, _pool_lock = None, threading.Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_pool)  # a forked child has the pool, but none of its threads


def _join(futures: list[Future[None]]) -> None:
    """Wait until no helper runs any more, also when Ctrl-C comes: the caller may free or reuse its arrays then.

    Not when it comes again: a helper may wait for a lock that the first one has left locked.
    """
    interrupt: KeyboardInterrupt | None = None
    while True:
        try:
            wait(futures)
            break
        except KeyboardInterrupt as error:
            if interrupt is not None:
                raise
            interrupt = error
    if interrupt is not None:
        raise interrupt


def run_rows(height: int, task: Callable[[int, int], object], chunk: int | None = None) -> None:
    """Call task(start, stop) for row ranges that together cover 0…height exactly once.

    The calling thread works too, with numba.get_num_threads() − 1 helpers, so that nested and concurrent calls
    make progress whatever the pool is busy with.

    Parameters
    ----------
    height : int
        Number of rows H.
    task : callable
        Runs on rows start…stop−1; should spend its time in code that releases the GIL.
    chunk : int, optional
        Rows per range; None: an eighth of a thread's share.

    Raises
    ------
    Exception
        The first error a task raised. Ranges not begun by then are left out, and none is running any more.
    """
    workers = max(1, min(numba.get_num_threads(), height))
    size = chunk or max(1, -(-height // (workers * CHUNKS_PER_THREAD)))
    starts = iter(range(0, height, size))
    lock = threading.Lock()
    stopped = False

    def drain() -> None:
        nonlocal stopped
        while True:
            with lock:
                start = None if stopped else next(starts, None)
            if start is None:
                return
            try:
                task(start, min(start + size, height))
            except BaseException:
                stopped = True
                raise

    helpers: list[Future[None]] = []
    try:
        if size < height:
            helpers += [_shared_pool().submit(drain) for _ in range(workers - 1)]
        drain()
    finally:
        stopped = True
        _join([helper for helper in helpers if not helper.cancel()])
    for helper in helpers:
        if not helper.cancelled():
            helper.result()
