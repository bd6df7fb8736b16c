"""The report of a check as one page that opens in any browser, offline."""
