import pytest

from voroquad._files import atomic_directory, atomic_path


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
