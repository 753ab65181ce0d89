"""The same results in one process and in several, and a sentence for a worker that dies."""

import multiprocessing
import os
import time

import pytest
import torch

from structdiffusion.workers import WorkerError, in_parallel


def add(loaded, job):
    return loaded + job, torch.get_num_threads()


def sleep(loaded, job):
    time.sleep(job)


def die(loaded, job):
    os._exit(job)


@pytest.mark.parametrize(("workers", "ordered"), [(1, True), (1, False), (2, False)])
def test_every_job_has_its_result_on_one_thread(workers, ordered):
    threads = torch.get_num_threads()
    results = list(in_parallel(add, int, ("40",), [2, 1, 0], workers, ordered=ordered))
    assert (results if ordered else sorted(results, reverse=True)) == [(42, 1), (41, 1), (40, 1)]
    assert torch.get_num_threads() == threads


def test_a_worker_that_dies():
    with pytest.raises(WorkerError, match="one of 2 worker processes died"):
        list(in_parallel(die, int, (), [3, 3, 3], 2))


def test_workers_end_when_nobody_waits_for_them_any_more():
    results = in_parallel(sleep, int, (), [0, 600, 600, 600], 2)
    next(results)
    workers = multiprocessing.active_children()
    assert workers
    results.close()
    assert not multiprocessing.active_children()
    assert all(worker.exitcode < 0 for worker in workers)  # ended by a signal, in the middle of their jobs
