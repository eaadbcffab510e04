"""Work in another process: what comes back, what breaks it off, and what its death is."""

import os
import time

import pytest

from pipeline.errors import UsageError
from pipeline.studio.scan.elsewhere import Elsewhere, ElsewhereError


class NoMoreWantedError(Exception):
    """Raised by what is called while work goes on."""


@pytest.fixture(scope="module")
def elsewhere():
    made = Elsewhere()
    yield made
    made.end()


def wanted():
    pass


def refuse():
    msg = "refused; ask for less"
    raise UsageError(msg)


def test_results_and_errors_come_back(elsewhere):
    assert elsewhere.call(divmod, wanted, 7, 2) == (3, 1)
    assert elsewhere.call(os.getpid, wanted) not in {os.getpid(), None}
    assert elsewhere.call(sorted, wanted, [1, 2], reverse=True) == [2, 1]
    with pytest.raises(UsageError, match="refused; ask for less"):
        elsewhere.call(refuse, wanted)
    with pytest.raises(ElsewhereError, match="unexpected ZeroDivisionError"):
        elsewhere.call(divmod, wanted, 7, 0)


def test_work_that_is_not_wanted_ends_at_once(elsewhere):
    first = elsewhere.call(os.getpid, wanted)

    def over():
        raise NoMoreWantedError

    begun = time.monotonic()
    with pytest.raises(NoMoreWantedError):
        elsewhere.call(time.sleep, over, 60)
    assert time.monotonic() - begun < 20
    assert elsewhere.call(os.getpid, wanted) != first


def test_a_process_that_dies_is_a_sentence_and_there_is_another(elsewhere):
    with pytest.raises(ElsewhereError, match=r"exit code 3.*clean\.voxel_m"):
        elsewhere.call(os._exit, wanted, 3)
    assert elsewhere.call(divmod, wanted, 9, 4) == (2, 1)
