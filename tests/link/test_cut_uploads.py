"""A sample of the uploads that ``make bench`` makes thousands of."""

from __future__ import annotations

import pytest
from cut_uploads import cut_upload


@pytest.mark.parametrize("number", range(0, 24, 2))
def test_an_upload_over_a_bad_line_claims_nothing_that_is_not_so(number: int) -> None:
    done = cut_upload(number)
    assert not done.fault, done
