"""The report of a check as one page that opens in any browser, offline."""

from __future__ import annotations
