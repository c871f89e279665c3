"""Only loopback answers, and only to the explorer's own page."""

import asyncio
import re
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request

import pytest
from tornado.httpclient import HTTPClientError, HTTPRequest
from tornado.websocket import websocket_connect


def get(server, path="", **headers):
    request = urllib.request.Request(server.url + path, headers={k.replace("_", "-"): v for k, v in headers.items()})
    try:
        with urllib.request.urlopen(request, timeout=20) as answer:
            return answer.status, dict(answer.headers), answer.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, dict(error.headers), ""


def test_the_page_takes_nothing_from_elsewhere(server):
    status, headers, body = get(server)
    assert status == 200
    links = re.findall(r'(?:src|href)="([^"]+)"', body)
    assert links
    assert all(link.startswith(("/static/", "data:")) for link in links)
    assert "<title>voroquad explore</title>" in body
    assert "default-src 'self'" in headers["Content-Security-Policy"]
    assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]


def test_bokeh_resources_cannot_be_redirected(server, monkeypatch):
    monkeypatch.setenv("BOKEH_RESOURCES", "cdn")
    _, _, body = get(server)
    assert "cdn.bokeh.org" not in re.sub(r"<script type=.application/json.*?</script>", "", body, flags=re.S)


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({}, 200),
        ({"Sec_Fetch_Site": "none", "Sec_Fetch_Mode": "navigate"}, 200),
        ({"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "navigate"}, 200),  # a link that somebody follows
        ({"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "no-cors"}, 403),
        ({"Sec_Fetch_Site": "same-site", "Sec_Fetch_Mode": "cors"}, 403),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "null"}, 403),
        ({"Host": "evil.example"}, 403),
        ({"Host": "evil.example:{port}"}, 403),
        ({"Host": "127.0.0.1"}, 403),
    ],
)
def test_who_may_ask(server, headers, status):
    headers = {name: value.format(port=server.port) for name, value in headers.items()}
    paths = [
        "static/js/bokeh.min.js",
        *(["", "autoload.js?bokeh-autoload-element=1", "metadata"] if status == 403 else []),
    ]
    for path in paths:
        assert get(server, path, **headers)[0] == status


@pytest.mark.parametrize("own", [True, False])
def test_a_page_of_another_site_gets_no_socket(server, own, monkeypatch):
    monkeypatch.setenv("BOKEH_ALLOW_WS_ORIGIN", "*")
    _, _, body = get(server)
    token = re.search(r'"token":"([^"]+)"', body)[1]
    origin = server.url.rstrip("/") if own else "http://evil.example"

    async def connect():
        request = HTTPRequest(server.url.replace("http", "ws") + "ws", headers={"Origin": origin})
        socket = await websocket_connect(request, subprotocols=["bokeh", token])
        message = await socket.read_message()
        socket.close()
        return message

    if own:
        assert asyncio.run(connect()) is not None
    else:
        with pytest.raises(HTTPClientError, match="403"):
            asyncio.run(connect())


def test_only_loopback_listens(server):
    listening = [s for s in server.sockets if s.family in (socket.AF_INET, socket.AF_INET6)]
    assert [s.getsockname()[0] for s in listening] == ["127.0.0.1"]
    for address in {info[4][0] for info in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)}:
        if not address.startswith("127."):
            with pytest.raises(OSError, match=r"refused|unreachable"):
                socket.create_connection((address, server.port), timeout=2)


def test_the_command_prints_its_address_and_ends_quietly():
    command = [sys.executable, "-c", "from voroquad.cli import main; main()", "explore"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        url = re.match(r"http://127\.0\.0\.1:\d+/", process.stdout.readline())
        assert url
        with urllib.request.urlopen(url[0] + "static/js/bokeh.min.js", timeout=60) as answer:
            assert answer.status == 200
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == 0
    assert errors == ""
