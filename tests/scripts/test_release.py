"""What wheels are tested with is complete."""

import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_wheels_are_tested_with_all_helper_modules() -> None:
    wheels = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["cibuildwheel"]
    helpers = {f"tests/{path.name}" for path in (ROOT / "tests").glob("*.py") if not path.name.startswith("test_")}
    assert helpers <= set(wheels["test-sources"])
    assert all((ROOT / source).exists() for source in wheels["test-sources"])
