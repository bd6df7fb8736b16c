"""Thousands of uploads over bad and cut lines: ``UPLOADS=10000 make bench``, some 0.1 s each."""

from __future__ import annotations

import os
from collections import Counter

import pytest
from cut_uploads import cut_upload

pytestmark = pytest.mark.bench


def test_no_upload_claims_what_is_not_so() -> None:
    count = int(os.environ.get("UPLOADS", "300"))
    done = [cut_upload(number) for number in range(count)]
    claims = Counter((one.claim or "nothing", one.held, one.is_back) for one in done)
    print(f"\n{count} uploads, by claim, what was held, whether the line came back: {dict(claims)}")
    assert [one for one in done if one.fault] == []
