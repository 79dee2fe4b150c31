# SPDX-License-Identifier: MIT
"""A page in headless Chromium, by its DevTools protocol."""
import base64
import itertools
import json
import shutil
import subprocess
import tempfile
import time
import urllib.request

import websocket

START_S = 60
WAIT_S = 120


class Browser:
    """Chromium; a context manager. Each page is a tab of its own."""

    def __enter__(self):
        self.folder = tempfile.mkdtemp(prefix="farlight-chromium-")
        self.process = subprocess.Popen(
            ["chromium", "--headless=new", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0",
             "--remote-allow-origins=*", f"--user-data-dir={self.folder}", "--no-first-run", "--window-size=640,480",
             "about:blank"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        for line in self.process.stderr:
            if "DevTools listening on" in line:
                self.port = int(line.split("ws://")[1].split("/")[0].split(":")[1])
                return self
        raise AssertionError("chromium ended before it listened")

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()
        self.process.stderr.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def open(self, address, width=320, height=240):
        request = urllib.request.Request(f"http://127.0.0.1:{self.port}/json/new?about:blank", method="PUT")
        target = json.load(urllib.request.urlopen(request, timeout=START_S))
        return Page(target["webSocketDebuggerUrl"], address, width, height)


class Page:
    def __init__(self, debugger, address, width, height):
        self.socket = websocket.create_connection(debugger, timeout=WAIT_S, suppress_origin=True)
        self.numbers = itertools.count(1)
        self.faults = []  # errors of scripts, and what the content policy forbids
        for domain in ("Runtime", "Page", "Log"):
            self.call(f"{domain}.enable")
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        self.call("Page.bringToFront")  # what is behind is not animated
        self.call("Page.navigate", url=address)

    def call(self, method, **parameters):
        number = next(self.numbers)
        self.socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            message = json.loads(self.socket.recv())
            if message.get("method") == "Runtime.exceptionThrown":
                self.faults.append(message["params"]["exceptionDetails"])
            if message.get("method") == "Log.entryAdded" and message["params"]["entry"]["source"] in ("security", "javascript"):
                self.faults.append(message["params"]["entry"])
            if message.get("id") == number:
                if "error" in message:
                    raise AssertionError(message["error"])
                return message["result"]

    def value(self, expression):
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise AssertionError(answer["exceptionDetails"])
        return answer["result"].get("value")

    def wait(self, expression):
        """Until it is true in the page."""
        deadline = time.monotonic() + WAIT_S
        while time.monotonic() < deadline:
            if found := self.value(expression):
                return found
            time.sleep(0.05)
        raise AssertionError(f"not in time: {expression}; the page says {self.status()}")

    def status(self):
        return self.value("document.getElementById('status').textContent")

    def shown(self):
        """What the canvas says of the picture."""
        return self.value("({...document.getElementById('picture').dataset})")

    def picture(self):
        """The canvas, as PNG."""
        url = self.value("document.getElementById('picture').toDataURL('image/png')")
        return base64.b64decode(url.split(",")[1])

    def mouse(self, kind, x, y, **more):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def drag(self, x, y, right, down, steps=10, button="left"):
        held = {"left": 1, "right": 2}[button]
        self.mouse("mousePressed", x, y, button=button, buttons=held, clickCount=1)
        for i in range(1, steps + 1):
            self.mouse("mouseMoved", x + right * i // steps, y + down * i // steps, button=button, buttons=held)
        self.mouse("mouseReleased", x + right, y + down, button=button, clickCount=1)

    def close(self):
        self.call("Page.close")
        self.socket.close()
