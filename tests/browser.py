"""A headless Chromium, driven over the pipe of its DevTools protocol, which needs no package."""

from __future__ import annotations

import base64
import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import pytest

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
# A browser is no Python package, so a developer may be without; CI has installed it, and must fail.
needs_chromium = pytest.mark.skipif(
    CHROMIUM is None and "CI" not in os.environ, reason="Chromium is not installed"
)
PATIENCE = 60.0  # s that a page may take to be ready

OPTIONS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--hide-scrollbars",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--remote-debugging-pipe",
)  # fmt: skip


class Browser:
    """One tab: what it is told, and what it has said since it was opened.

    Attributes
    ----------
    requests
        Addresses of everything it has asked for, pages included.
    errors
        Console errors, exceptions and refusals of the page's policy.
    """

    def __init__(self) -> None:
        self.requests: list[str] = []
        self.errors: list[str] = []
        self._count, self._session, self._read = 0, "", b""
        self._loaded: set[str] = set()

    def __enter__(self) -> Self:
        assert CHROMIUM is not None
        self._folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        theirs_in, self._to = os.pipe()
        self._from, theirs_out = os.pipe()

        def at_3_and_4() -> None:
            os.dup2(theirs_in, 13), os.dup2(theirs_out, 14)
            os.dup2(13, 3), os.dup2(14, 4)

        self._process = subprocess.Popen(
            [CHROMIUM, *OPTIONS, f"--user-data-dir={self._folder.name}"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            preexec_fn=at_3_and_4,
            close_fds=False,
        )
        os.close(theirs_in)
        os.close(theirs_out)
        target = self.send("Target.createTarget", url="about:blank")["targetId"]
        attached = self.send("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log", "DOM"):
            self.send(f"{domain}.enable")
        self.send("Page.setLifecycleEventsEnabled", enabled=True)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._session = ""
        self.send("Browser.close")
        self._process.wait(20)
        os.close(self._to)
        os.close(self._from)
        self._folder.cleanup()

    def send(self, method: str, **parameters: Any) -> Any:
        """Call a method of the protocol; returns its result."""
        self._count += 1
        message: dict[str, Any] = {"id": self._count, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        text = json.dumps(message).encode() + b"\0"
        while text:
            text = text[os.write(self._to, text) :]
        while True:
            answer = self._next()
            if answer.get("id") == self._count:
                assert "error" not in answer, f"{method}: {answer['error']}"
                return answer["result"]

    def _next(self) -> Mapping[str, Any]:
        """The next message; what it says of requests and errors is kept."""
        while b"\0" not in self._read:
            more = os.read(self._from, 1 << 16)
            assert more, "Chromium has ended"
            self._read += more
        text, _, self._read = self._read.partition(b"\0")
        message: Mapping[str, Any] = json.loads(text)
        said = message.get("params", {})
        match message.get("method"):
            case "Page.lifecycleEvent" if said["name"] == "load":
                self._loaded.add(said["loaderId"])
            case "Network.requestWillBeSent":
                address = said["request"]["url"]
                if not address.startswith(("data:", "blob:")):  # which are in the page itself
                    self.requests.append(address)
            case "Runtime.exceptionThrown":
                self.errors.append(json.dumps(said["exceptionDetails"])[:1000])
            case "Runtime.consoleAPICalled" if said["type"] in ("error", "assert"):
                self.errors.append(json.dumps(said["args"])[:1000])
            case "Log.entryAdded" if said["entry"]["level"] == "error":
                self.errors.append(said["entry"]["text"])
        return message

    def run(self, script: str) -> Any:
        """The value of an expression, awaited."""
        result = self.send(
            "Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True
        )
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    def open(self, path: Path, state: str = "", ready: str = "true") -> None:
        """Open a file and wait until an expression is true of it."""
        self._go("about:blank")
        self.requests.clear()
        self.errors.clear()
        self._go(path.resolve().as_uri() + state)
        self.wait(ready)

    def _go(self, address: str) -> None:
        loader = self.send("Page.navigate", url=address)["loaderId"]
        while loader not in self._loaded:
            self._next()

    def wait(self, condition: str) -> None:
        """Wait until an expression is true."""
        self.run(
            "new Promise((done, failed) => { const look = () => "
            f"({condition}) ? done() : performance.now() > {1e3 * PATIENCE} "
            "? failed('waited too long') : setTimeout(look, 20); look(); })"
        )

    def size(self, width: int, height: int, *, printed: bool = False) -> None:
        """Of the window, in CSS pixels; as for a printer."""
        self.send(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1,
            mobile=False,
        )  # fmt: skip
        self.send("Emulation.setEmulatedMedia", media="print" if printed else "")

    def shot(self, path: Path) -> None:
        """A picture of the whole page."""
        found = self.send("Page.captureScreenshot", captureBeyondViewport=True)
        path.write_bytes(base64.b64decode(found["data"]))

    def choose_files(self, selector: str, *paths: Path) -> None:
        """Give files to an input of the page."""
        root = self.send("DOM.getDocument")["root"]["nodeId"]
        node = self.send("DOM.querySelector", nodeId=root, selector=selector)["nodeId"]
        self.send("DOM.setFileInputFiles", nodeId=node, files=[str(p.resolve()) for p in paths])


@contextmanager
def browser() -> Iterator[Browser]:
    """A browser, closed at the end."""
    with Browser() as opened:
        yield opened
