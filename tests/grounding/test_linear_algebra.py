"""Products of matrices in one thread."""

import threadpoolctl

from grounding.linear_algebra import one_thread


def test_matrices_are_multiplied_in_one_thread():
    numpy_alone = threadpoolctl.ThreadpoolController()

    def threads():
        return [pool["num_threads"] for pool in numpy_alone.info() if pool["user_api"] == "blas"]

    before = threads()
    with one_thread():
        assert threads() == [1] * len(before)
    assert threads() == before
