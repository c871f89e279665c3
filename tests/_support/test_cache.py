"""The cache directory, and whose files in it are trusted."""

import os

import pytest

from voroquad._support.cache import cache_directory, is_own


def test_the_directory_follows_the_environment(monkeypatch, tmp_path):
    monkeypatch.setenv("VOROQUAD_CACHE_DIR", str(tmp_path / "own"))
    assert cache_directory() == tmp_path / "own"
    monkeypatch.delenv("VOROQUAD_CACHE_DIR")
    assert cache_directory().name == "voroquad"


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="POSIX permissions")
def test_the_open_file_is_asked_and_not_its_name(tmp_path):
    path = tmp_path / "file"
    path.write_text("")
    path.chmod(0o666)
    with path.open("rb") as file:
        path.unlink()
        path.write_text("")  # one that would be trusted
        assert not is_own(file)
    with path.open("rb") as file:
        assert is_own(file)
