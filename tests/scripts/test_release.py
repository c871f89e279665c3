"""What wheels are built from and tested with is complete."""

import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def test_wheels_are_tested_with_all_helper_modules() -> None:
    wheels = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["cibuildwheel"]
    helpers = {f"tests/{path.name}" for path in (ROOT / "tests").glob("*.py") if not path.name.startswith("test_")}
    assert helpers <= set(wheels["test-sources"])
    assert all((ROOT / source).exists() for source in wheels["test-sources"])


@pytest.mark.parametrize(("from_sdist", "levels"), [(False, "this-machine"), (True, "all")])
def test_an_sdist_is_built_for_every_processor(
    from_sdist: bool, levels: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = pytest.importorskip("scikit_build_core.settings.skbuild_read_settings")
    if from_sdist:
        (tmp_path / "PKG-INFO").touch()
    monkeypatch.chdir(tmp_path)
    read = settings.SettingsReader.from_file(ROOT / "pyproject.toml", state="wheel")
    assert read.settings.cmake.define["VOROQUAD_LEVELS"] == levels
