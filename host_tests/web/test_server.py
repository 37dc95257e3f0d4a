"""The server of `kickstand web`: types, addresses, ports, and clients that are slow, silent or strange."""

import contextlib
import http.client
import socket
import threading

import pytest
from kickstand_tools.web import serve

FILES = {"index.html": b"the page", "a b.mjs": b"code", "x/y.unknown": b"?", "m.wasm": b"\0asm", "empty.txt": b""}


@contextlib.contextmanager
def serving(files=FILES):
    with serve.server(files, 0) as server:
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        yield server.server_address[1]
        server.shutdown()


@pytest.fixture(scope="module")
def port():
    with serving() as port:
        yield port


def answer_to(port, request):
    """Send a request. Return everything that the server sends until it disconnects."""
    with socket.create_connection((serve.HOST, port), timeout=20) as connection:
        connection.sendall(request)
        return b"".join(iter(lambda: connection.recv(4096), b""))


@pytest.mark.parametrize(
    ("path", "name", "kind"),
    [
        ("/", "index.html", "text/html; charset=utf-8"),
        ("/index.html?x=1#y", "index.html", "text/html; charset=utf-8"),
        ("/a%20b.mjs", "a b.mjs", "text/javascript; charset=utf-8"),
        ("/m.wasm", "m.wasm", "application/wasm"),
        ("/x/y.unknown", "x/y.unknown", "application/octet-stream"),
        ("/empty.txt", "empty.txt", "text/plain; charset=utf-8"),
        ("/none.html", None, "text/html; charset=utf-8"),
    ],
)
@pytest.mark.parametrize("method", ["GET", "HEAD"])
def test_each_file_is_served_with_its_type(port, method, path, name, kind):
    with contextlib.closing(http.client.HTTPConnection(serve.HOST, port, timeout=20)) as connection:
        connection.request(method, path)
        answer = connection.getresponse()
        content = FILES.get(name, b"")
        assert answer.read() == (content if method == "GET" else b"")
    assert answer.status == (404 if name is None else 200)
    assert answer.headers["Content-Type"] == kind and int(answer.headers["Content-Length"]) == len(content)
    assert answer.headers["Cache-Control"] == "no-cache"  # browsers load a new version at once
    assert answer.headers["X-Content-Type-Options"] == "nosniff"


def test_every_file_of_the_site_has_a_type(files):
    assert {name for name in files if "." + name.rpartition(".")[2] not in serve.TYPES} == set()


@pytest.mark.parametrize("path", [b"http://[::1/", b"//[", b"/../../etc/passwd", b"/%00", b"/" + b"a" * 60_000])
def test_strange_addresses_are_answered(port, path, capsys):
    assert answer_to(port, b"GET " + path + b" HTTP/1.0\r\n\r\n").startswith(b"HTTP/1.1 4")
    assert "Traceback" not in capsys.readouterr().err


def test_a_used_port_is_replaced_by_a_free_one():
    with serving() as first, serve.server({}, first) as second:
        assert second.server_address[1] not in (0, first)


def test_silent_connections_do_not_hold_the_page():
    """Each connection above the limit of 64 ends the oldest one without a request."""
    with serving() as port, contextlib.ExitStack() as opened:

        def connect():
            return opened.enter_context(socket.create_connection((serve.HOST, port), timeout=10.0))

        connections = [connect() for _ in range(64)]
        latest = connect()
        assert connections[0].recv(1) == b""  # the server has ended the connection
        connections[1].setblocking(False)
        with pytest.raises(BlockingIOError):
            connections[1].recv(1)
        latest.sendall(b"GET / HTTP/1.0\r\n\r\n")
        assert latest.recv(12) == b"HTTP/1.1 200"
        for _ in range(100):
            connect()
        assert answer_to(port, b"GET / HTTP/1.0\r\n\r\n").endswith(b"the page")
