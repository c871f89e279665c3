import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

import voroquad as vq
from voroquad._support.files import atomic_directory, atomic_path


def test_a_file_is_whole_or_as_it_was(tmp_path):
    target = tmp_path / "deep" / "out.csv"
    with atomic_path(target) as path:
        path.write_text("new")
    assert target.read_text() == "new"
    with pytest.raises(KeyboardInterrupt), atomic_path(target) as path:
        path.write_text("half")
        raise KeyboardInterrupt
    assert target.read_text() == "new"
    assert [p.name for p in target.parent.iterdir()] == ["out.csv"]


def test_a_full_disk_is_told_with_the_files_name(tmp_path):
    target = tmp_path / "out.csv"
    with pytest.raises(OSError, match=r"No space left on device: .*out\.csv'"), atomic_path(target):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    with pytest.raises(FileNotFoundError, match="elsewhere"), atomic_path(target):
        Path("elsewhere").read_text()
    assert list(tmp_path.iterdir()) == []


def test_a_directory_is_whole_or_as_it_was(tmp_path):
    target = tmp_path / "out"
    target.mkdir()
    (target / "kept").write_text("kept")
    (target / "made").write_text("old")
    with atomic_directory(target) as path:
        (path / "made").write_text("new")
        (path / "sub").mkdir()
    assert (target / "made").read_text() == "new"
    assert (target / "kept").read_text() == "kept"
    with pytest.raises(RuntimeError), atomic_directory(target) as path:
        (path / "made").write_text("half")
        raise RuntimeError
    assert (target / "made").read_text() == "new"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out"]


def test_a_folder_of_the_users_stays_beside_what_is_written(tmp_path):
    target = tmp_path / "out"
    (target / "images").mkdir(parents=True)
    (target / "images" / "mine").write_text("mine")
    with atomic_directory(target) as path:
        (path / "images").mkdir()
        (path / "images" / "made").write_text("made")
    assert sorted(p.name for p in (target / "images").iterdir()) == ["made", "mine"]


def test_obstacles_are_refused_before_anything_moves(tmp_path):
    target = tmp_path / "out"
    target.mkdir()
    (target / "images").write_text("a file")
    with pytest.raises(ValueError, match="is a file, where a folder"), atomic_directory(target) as path:
        (path / "first").write_text("first")
        (path / "images").mkdir()
        (path / "images" / "made").write_text("made")
    assert [p.name for p in target.iterdir()] == ["images"]


def test_links_are_followed_and_devices_stay(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "real")
    with atomic_path(tmp_path / "link") as path:
        path.write_text("new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "new"
    with atomic_path("/dev/null") as path:
        path.write_text("gone")
    assert Path("/dev/null").is_char_device()


def test_folders_made_for_a_file_that_failed_go_again(tmp_path):
    with pytest.raises(RuntimeError), atomic_path(tmp_path / "a" / "b" / "c.csv") as path:
        path.write_text("half")
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []


def test_a_descriptor_goes_on_where_it_is(tmp_path):
    """As in `voroquad weights points.csv -o /dev/stdout >> log`."""
    log = tmp_path / "log"
    log.write_text("before\n")
    program = """
from voroquad._support.files import atomic_path
print("first")
for name in ("/dev/stdout", "/dev/fd/1"):
    with atomic_path(name) as path:
        path.write_text(name + "\\n")
print("last")
"""
    with log.open("a") as stream:
        subprocess.run([sys.executable, "-c", program], stdout=stream, check=True)
    assert log.read_text() == "before\nfirst\n/dev/stdout\n/dev/fd/1\nlast\n"


def test_nothing_is_written_into_a_stream_before_all_is_there(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    with pytest.raises(KeyboardInterrupt), atomic_path(pipe) as path:
        path.write_text("half")
        raise KeyboardInterrupt
    assert os.read(reader, 100) == b""
    with atomic_path(pipe) as path:
        path.write_text("whole")
    assert os.read(reader, 100) == b"whole"
    os.close(reader)
    assert [p.name for p in tmp_path.iterdir()] == ["pipe"]


def test_a_device_is_written_and_stays(tmp_path):
    vq.SampleTable.make("uniform", 4, 1, 2, rng=1).save("/dev/null")
    assert Path("/dev/null").is_char_device()
    assert not Path("/dev/null.npz").exists()


def test_permissions_are_those_of_any_new_file_and_the_umask_is_not_touched(tmp_path, monkeypatch):
    before = os.umask(0o027)
    try:
        with monkeypatch.context() as patch:
            patch.setattr(os, "umask", lambda mask: pytest.fail("the umask belongs to all threads"))
            with atomic_path(tmp_path / "out.csv") as path:
                path.write_text("new")
    finally:
        os.umask(before)
    assert (tmp_path / "out.csv").stat().st_mode & 0o777 == 0o640
