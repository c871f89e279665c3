import os
import signal
import subprocess
import sys

import pytest

from voroquad._support.files import atomic_directory
from voroquad._support.locks import only_writer

HOLD = "import sys, time\nfrom voroquad._support.locks import only_writer\n"
HOLD += "with only_writer(sys.argv[1]):\n    print('held', flush=True)\n    time.sleep(60)"


@pytest.fixture
def holder(tmp_path):
    """Another process that writes tmp_path/out."""
    with subprocess.Popen([sys.executable, "-c", HOLD, tmp_path / "out"], stdout=subprocess.PIPE) as process:
        assert process.stdout.readline() == b"held\n"
        yield process
        process.kill()


def test_another_process_is_refused_until_the_writer_ends(tmp_path, holder):
    with pytest.raises(ValueError, match=r"another process is writing .*out; wait"), only_writer(tmp_path / "out"):
        pass
    with pytest.raises(ValueError, match="another process is writing"), atomic_directory(tmp_path / "out"):
        pass
    with only_writer(tmp_path / "other"):
        pass
    assert os.listdir(tmp_path) == [".out.lock"]
    holder.send_signal(signal.SIGKILL)
    holder.wait()
    assert os.listdir(tmp_path) == [".out.lock"]  # it locks nothing any more
    with only_writer(tmp_path / "out"):
        assert os.listdir(tmp_path) == [".out.lock"]
    assert os.listdir(tmp_path) == []


def test_a_link_leads_to_the_same_lock(tmp_path, holder):
    (tmp_path / "link").symlink_to(tmp_path / "out")
    with pytest.raises(ValueError, match=r"another process is writing .*link"), only_writer(tmp_path / "link"):
        pass


def test_an_exception_ends_it(tmp_path):
    with pytest.raises(KeyboardInterrupt), only_writer(tmp_path / "out"):
        raise KeyboardInterrupt
    assert os.listdir(tmp_path) == []
