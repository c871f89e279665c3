"""An explorer that answers as `voroquad explore` does."""

import asyncio
import threading

import pytest

from voroquad.explore.server import ExplorerServer


@pytest.fixture(scope="module")
def server():
    started = threading.Event()
    servers = []

    def run():
        asyncio.set_event_loop(asyncio.new_event_loop())
        servers.append(ExplorerServer())
        started.set()
        servers[0].run()

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    assert started.wait(10)
    yield servers[0]
    servers[0].stop()
    thread.join(10)
    assert not thread.is_alive()
