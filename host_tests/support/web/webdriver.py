"""WebKit by WebDriver, and Firefox by Marionette, its own protocol. Neither needs anything besides the browser.

Both have the methods visit(), run(), click() and end(). Raises Missing if the browser is not installed.
"""

import itertools
import json
import os
import shutil
import socket
import subprocess
import tempfile
import time
import urllib.error
import urllib.request
from pathlib import Path

START_S = 30.0


class Missing(Exception):
    """The browser is not installed. The text says how to get it."""


def _program(*names):
    path = next(filter(None, map(shutil.which, names)), None)
    if path is None:
        raise Missing(names[0])
    return path


def _until(function, error):
    """Call a function until it does not raise this error. Return its result."""
    begin_s = time.monotonic()
    while True:
        try:
            return function()
        except error:
            if time.monotonic() - begin_s > START_S:
                raise
            time.sleep(0.1)


class _Browser:
    def __init__(self):
        self._processes = []

    def _start(self, *command, **options):
        self._processes.append(subprocess.Popen(command, stderr=subprocess.DEVNULL, **options))
        return self._processes[-1]

    def run(self, script, *arguments):
        """Return the result of a function's body in JavaScript."""
        return self._command("ExecuteScript", "POST", "execute/sync", {"script": script, "args": list(arguments)})

    def visit(self, address):
        self._command("Navigate", "POST", "url", {"url": address})

    def click(self, selector):
        query = {"using": "css selector", "value": selector}
        reply = self._command("FindElement", "POST", "element", query)
        (element,) = reply.get("value", reply).values()
        self._command("ElementClick", "POST", f"element/{element}/click", {"id": element})

    def _command(self, name, method, path, body):
        raise NotImplementedError

    def end(self):
        for process in reversed(self._processes):
            process.terminate()
            process.communicate()


class WebKit(_Browser):
    """WebKitGTK's small browser, on a display in memory."""

    def __init__(self):
        super().__init__()
        driver, screen = _program("WebKitWebDriver"), _program("Xvfb")
        display = self._start(screen, "-displayfd", "1", "-nolisten", "tcp", stdout=subprocess.PIPE, text=True)
        environment = os.environ | {"DISPLAY": ":" + display.stdout.readline().strip()}
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        self._start(driver, f"--port={port}", env=environment, stdout=subprocess.DEVNULL)
        self._address = f"http://127.0.0.1:{port}/session"
        self._session = ""
        capabilities = {"capabilities": {"alwaysMatch": {}}}
        session = _until(lambda: self._command("NewSession", "POST", "", capabilities), urllib.error.URLError)
        self._session = "/" + session["sessionId"] + "/"

    def _command(self, name, method, path, body):
        content = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self._address + self._session + path, content, method=method)
        with urllib.request.urlopen(request, timeout=60) as answer:
            return json.load(answer)["value"]

    def end(self):
        self._command("DeleteSession", "DELETE", "", None)
        super().end()


class Firefox(_Browser):
    def __init__(self):
        super().__init__()
        program = _program("firefox-esr", "firefox")
        self._profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        Path(self._profile.name, "user.js").write_text('user_pref("marionette.port", 0);\n')
        command = program, "--headless", "--marionette", "--no-remote", "--profile", self._profile.name
        self._start(*command, stdout=subprocess.DEVNULL)
        port = Path(self._profile.name, "MarionetteActivePort")
        self._numbers = itertools.count()
        self._socket = _until(
            lambda: socket.create_connection(("127.0.0.1", int(port.read_text())), timeout=60), (OSError, ValueError)
        )
        self._receive()  # the greeting
        self._command("NewSession", "", "", {})

    def _receive(self):
        length = b""
        while not length.endswith(b":"):
            length += self._socket.recv(1)
        data = b""
        while len(data) < int(length[:-1]):
            data += self._socket.recv(65536)
        return json.loads(data)

    def _command(self, name, method, path, body):
        content = json.dumps([0, next(self._numbers), "WebDriver:" + name, body])
        self._socket.sendall(f"{len(content)}:{content}".encode())
        _, _, error, result = self._receive()
        if error:
            raise RuntimeError(error)
        return result.get("value", result) if name != "FindElement" else result

    def end(self):
        self._socket.close()
        super().end()
        self._profile.cleanup()
