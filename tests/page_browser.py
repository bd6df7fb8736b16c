"""A page in headless Chromium: opening it, and reading what it shows."""

from __future__ import annotations

import base64
import json
import re
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from selenium.webdriver import Chrome

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
DRIVER = shutil.which("chromedriver")
PHONE_PX = 390
WAIT_S = 30.0
"""Far more than a page takes; a machine may be busy."""
FLAGS = (
    "headless=new",
    "no-sandbox",
    "disable-gpu",
    "disable-dev-shm-usage",
    "disable-background-networking",
    "disable-component-update",
    "disable-sync",
    "no-first-run",
    "window-size=1200,900",
)
NEEDS_BROWSER = pytest.mark.skipif(
    CHROMIUM is None or DRIVER is None, reason="chromium and chromedriver are not installed"
)
_WAITED_FOR = (
    "article[data-mission]:not([data-drawn]) [data-chart], [data-pictures]:not([data-drawn])"
)


def opened(
    browser: Chrome, address: str, *, scheme: str = "light", width: int = 0, scripts: bool = True
) -> None:
    """Open a page and wait until it is there, with scripts until its pictures are drawn."""
    browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": not scripts})
    browser.execute_cdp_cmd(
        "Emulation.setEmulatedMedia",
        {"features": [{"name": "prefers-color-scheme", "value": scheme}]},
    )
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    if width:
        size = {"width": width, "height": 844, "deviceScaleFactor": 1, "mobile": True}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    # else an address that differs in its anchor alone is not loaded anew
    browser.get("about:blank")
    browser.get(address)
    # without scripts get() may come back while the page is still read
    until(browser, "return document.body && document.readyState === 'complete'")
    if scripts:
        until(browser, f"return !document.querySelector('{_WAITED_FOR}')")


def until(browser: Chrome, script: str) -> object:
    """Return what a script returns as soon as that is something."""
    from selenium.webdriver.support.wait import WebDriverWait

    return WebDriverWait(browser, WAIT_S).until(lambda driver: driver.execute_script(script))


def messages(browser: Chrome, log: str = "browser") -> list[str]:
    """Return what a log of the browser holds, and empty it."""
    entries = browser.get_log(log)  # type: ignore[no-untyped-call]  # selenium has no type for it
    return [entry["message"] for entry in entries]


def asked_for(browser: Chrome, address: str) -> set[str]:
    """Open a page and return the addresses that are asked for."""
    browser.get("about:blank")  # the browser's own first page asks for its parts
    messages(browser, "performance")
    opened(browser, address)
    events = [json.loads(one)["message"] for one in messages(browser, "performance")]
    return {
        event["params"]["request"]["url"]
        for event in events
        if event["method"] == "Network.requestWillBeSent"
        and not event["params"]["request"]["url"].startswith("chrome:")
    }


def shown(browser: Chrome) -> list[tuple[str, str, str]]:
    """Return path, value and text of every number that says which of the JSON it is."""
    found = browser.execute_script(
        "return [...document.querySelectorAll('data[data-key]')]"
        ".map(one => [one.dataset.key, one.value, one.textContent])"
    )
    return [(key, value, text) for key, value, text in found]


def at(document: Any, path: str) -> Any:  # noqa: ANN401 - whatever JSON holds
    """Return what a document holds at a path of keys and places."""
    for key in path.split("."):
        document = document[int(key) if isinstance(document, list) else key]
    return document


def grave_violations(browser: Chrome, *, is_unfolded: bool = True) -> list[tuple[str, list[str]]]:
    """Return what axe-core finds that is more than minor.

    Without the contrasts of missions that are left folded: those are a check's, and of all that is
    looked at they take the longest.  The missions are gone from the page then.
    """
    reason = "axe-core-python is not installed"
    axe = Path(pytest.importorskip("axe_core_python.base", reason=reason).AXE_FILE_PATH)
    for summary in browser.find_elements("css selector", "summary") if is_unfolded else ():
        browser.execute_script("arguments[0].parentElement.open = true", summary)
    undrawn = "details.mission[open]:not([data-drawn]) .charts"
    until(browser, f"return !document.querySelector('{undrawn}')")
    browser.execute_script(axe.read_text(encoding="utf-8"))
    if is_unfolded:
        found = _violations(browser)
    else:
        contrast = "color-contrast"
        found = _violations(browser, rules={contrast: {"enabled": False}})
        missions = "document.querySelectorAll('details.mission')"
        browser.execute_script(f"{missions}.forEach(one => one.remove())")
        found += _violations(browser, runOnly=[contrast])
    return [
        (one["id"], [node["html"][:200] for node in one["nodes"]][:3])
        for one in found
        if one["impact"] != "minor"
    ]


def _violations(browser: Chrome, **options: object) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = browser.execute_async_script(
        "const done = arguments[arguments.length - 1];"
        "axe.run({resultTypes: ['violations'], ...arguments[0]})"
        ".then(result => done(result.violations))",
        options,
    )
    return found


def sheets(browser: Chrome) -> int:
    """Return how many pages of A4 the open page prints to."""
    printed = browser.execute_cdp_cmd(
        "Page.printToPDF", {"printBackground": True, "preferCSSPageSize": True}
    )
    return len(re.findall(rb"/Type\s*/Page\b", base64.b64decode(printed["data"])))
