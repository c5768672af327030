"""A headless Chromium, driven over the pipe of its DevTools protocol, without any driver."""

import base64
import json
import os
import select
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome")
CHROMIUM = next(filter(None, map(shutil.which, NAMES)), None)
FLAGS = (
    *("--headless=new", "--no-sandbox", "--no-first-run", "--window-size=1000,700"),
    *("--disable-gpu", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
    "--remote-debugging-pipe",
)
NEEDS_BROWSER = [
    pytest.mark.browser,
    pytest.mark.skipif(
        CHROMIUM is None, reason="needs chromium on PATH (Debian: apt-get install chromium)"
    ),
]
PATIENCE = 120.0  # [s] for any one answer, on a busy machine
SPEED = "GPU stall due to ReadPixels"  # a driver's word on how fast pictures are read back


class Browser:
    """One browser with one page; everything that the page asks for or complains of is noted."""

    def __init__(self, profile: Path) -> None:
        """Start it with an empty profile."""
        (read_here, write_there), (read_there, write_here) = os.pipe(), os.pipe()
        # the protocol's pipes have these numbers
        command = f'exec "$@" 3<&{read_there} 4>&{write_there}'
        words = [str(CHROMIUM), *FLAGS, f"--user-data-dir={profile}", "about:blank"]
        self._process = subprocess.Popen(
            ["bash", "-c", command, "bash", *words],
            pass_fds=(read_there, write_there),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(read_there)
        os.close(write_there)
        self._read, self._write, self._left, self._count = read_here, write_here, b"", 0
        self._session: str | None = None
        self.requests: list[str] = []
        self.complaints: list[str] = []
        target = self._call("Target.createTarget", url="about:blank")["targetId"]
        attached = self._call("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self._call(f"{domain}.enable")

    def open(self, url: str, ready: str = "typeof motionPage === 'object'") -> None:
        """Load a page anew and wait for it."""
        self._call("Page.navigate", url="about:blank")
        self.run("0")
        self.requests.clear()
        self.complaints.clear()
        self._call("Page.navigate", url=url)
        end = time.monotonic() + PATIENCE
        while not self.run(f"document.readyState === 'complete' && {ready}"):
            assert time.monotonic() < end, f"{url} does not load: {self.complaints}"
            time.sleep(0.05)

    def look(self, width: int, height: int, scheme: str = "light") -> None:
        """Set the size of the window [px], and the scheme of colours that the reader prefers."""
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self._call("Emulation.setDeviceMetricsOverride", **size)
        preferred = [{"name": "prefers-color-scheme", "value": scheme}]
        self._call("Emulation.setEmulatedMedia", features=preferred)

    def run(self, script: str) -> Any:
        """Return the value of an expression in the page."""
        how = {"returnByValue": True, "userGesture": True}
        answer = self._call("Runtime.evaluate", expression=script, **how)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def screenshot(self) -> bytes:
        """Return a picture of the whole page, PNG."""
        return base64.b64decode(self._call("Page.captureScreenshot", format="png")["data"])

    def close(self) -> None:
        """End it."""
        os.close(self._write)  # it ends with its pipe
        try:
            self._process.wait(10.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        os.close(self._read)

    def _call(self, method: str, **parameters: Any) -> dict[str, Any]:
        self._count += 1
        message: dict[str, Any] = {"id": self._count, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self._count:
                assert "error" not in answer, answer
                return dict(answer["result"])
            self._note(answer.get("method", ""), answer.get("params", {}))

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._left:
            ready, _, _ = select.select([self._read], [], [], PATIENCE)
            assert ready, "the browser does not answer"
            part = os.read(self._read, 1 << 20)
            assert part, "the browser is gone"
            self._left += part
        text, _, self._left = self._left.partition(b"\0")
        return dict(json.loads(text))

    def _note(self, event: str, parameters: dict[str, Any]) -> None:
        if event == "Network.requestWillBeSent":
            self.requests.append(parameters["request"]["url"])
        elif event in ("Runtime.exceptionThrown", "Runtime.consoleAPICalled", "Log.entryAdded"):
            text = json.dumps(parameters)
            if SPEED not in text:
                self.complaints.append(text)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """Start a browser for the tests of one module."""
    found = Browser(tmp_path_factory.mktemp("profile"))
    yield found
    found.close()
