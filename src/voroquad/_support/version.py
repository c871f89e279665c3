"""The version number. pyproject.toml and CMakeLists.txt read it from this file."""

__version__ = "0.2.0"
