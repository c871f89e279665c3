"""The files of a scene: found before it is rendered, and hashed to distinguish scenes."""

from __future__ import annotations

import codecs
import hashlib
import html
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import mitsuba as mi

from .errors import one_line_errors

#: Levels of nested XML elements, included files counted. Mitsuba's parser recurses and overflows its stack at some
#: thousand levels.
MOST_LEVELS = 500
_ELEMENT = re.compile(
    r"<!--.*?-->|<!\[CDATA\[.*?\]\]>|<[?!][^>]*>"
    r"|<(?P<end>/)?(?P<tag>[^\s<>/\"'!?]+)(?P<attributes>(?:[^<>\"'/]|/(?!>)|\"[^\"]*\"|'[^']*')*+)(?P<empty>/)?>",
    re.DOTALL,
)
_ATTRIBUTE = re.compile(r"([^\s=\"']+)\s*=\s*(?:\"([^\"]*)\"|'([^']*)')")


def scene_files(path: Path, parameters: Mapping[str, str] | None = None) -> list[Path]:
    """The XML file of a scene and all files that it names: included scenes, textures, meshes, spectra.

    Parameters
    ----------
    path : Path
        Mitsuba XML file.
    parameters : mapping of str to str, optional
        Values of the scene's ``$name`` parameters.

    Returns
    -------
    list of Path
        The scene first, each file once. Files of Mitsuba's own installation are left out.

    Raises
    ------
    ValueError
        Mitsuba's parser refuses the scene, or its elements are nested too deeply.

    Notes
    -----
    Mitsuba's parser resolves parameters, ``<include>`` and ``<path>``. A plug-in learns of a file through a string
    property, so every string property that Mitsuba's file resolver can find names a dependency, whatever its plug-in.
    The parser itself reads the ``filename`` attributes of elements such as ``<spectrum>``; these are read from the XML.
    """
    values = dict(parameters or {})
    check_nesting(path, values)
    with _file_resolver(path.parent) as resolver, one_line_errors():
        state = mi.parser.parse_file(mi.parser.ParserConfig(mi.variant()), str(path), **values)
        parsed = [Path(str(file)) for file in state.files]
        own = Path(mi.__file__).parent
        folders = [Path(str(folder)) for folder in resolver]
        folders = [f for f in dict.fromkeys([*folders, *(file.parent for file in parsed)]) if f != own]
    names = {value for node in state.nodes for _, value in node.props.items() if isinstance(value, str)}
    for file in parsed:
        names |= {attributes["filename"] for _, _, attributes in _elements(file, values) if "filename" in attributes}
    found = (_find(name, folders) for name in sorted(names))
    return list(dict.fromkeys([path, *parsed, *(file for file in found if file is not None)]))


def file_hashes(path: Path, parameters: Mapping[str, str] | None = None) -> dict[str, str]:
    """Hashes of the contents of `scene_files`, by their paths relative to the scene."""
    return {
        Path(os.path.relpath(file, path.parent)).as_posix(): hashlib.sha256(file.read_bytes()).hexdigest()[:16]
        for file in scene_files(path, parameters)
    }


def check_nesting(path: Path, parameters: Mapping[str, str] | None = None) -> None:
    """Raise ValueError for elements that are nested so deeply that Mitsuba's parser would overflow its stack."""
    _check_levels(path, dict(parameters or {}), 0, set())


def _check_levels(path: Path, values: dict[str, str], above: int, seen: set[Path]) -> None:
    seen.add(path.resolve())
    for level, tag, attributes in _elements(path, values):
        if above + level > MOST_LEVELS:
            raise ValueError(f"{os.fspath(path)!r} nests elements more than {MOST_LEVELS} levels deep; flatten it")
        included = _find(attributes.get("filename", ""), [path.parent]) if tag == "include" else None
        if included is not None and included.resolve() not in seen:
            _check_levels(included, values, above + level, seen)


def _elements(path: Path, values: dict[str, str]) -> Iterator[tuple[int, str, dict[str, str]]]:
    """Level, tag and attributes of the elements of an XML file, as leniently as Mitsuba's parser reads it.

    ``$name`` is replaced by its value; a ``<default>`` adds to the `values`.
    """
    level = 0
    for match in _ELEMENT.finditer(_text(path)):
        if match["tag"] is None:
            continue
        if match["end"]:
            level -= 1
            continue
        attributes = {key: html.unescape(a or b) for key, a, b in _ATTRIBUTE.findall(match["attributes"])}
        for key, text in attributes.items():
            for name, value in values.items():
                text = text.replace(f"${name}", value)
            attributes[key] = text
        if match["tag"] == "default" and attributes.get("name"):
            values.setdefault(attributes["name"], attributes.get("value", ""))
        yield level + 1, match["tag"], attributes
        level += not match["empty"]


def _text(path: Path) -> str:
    content = path.read_bytes()
    utf_16 = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    return content.decode("utf-16" if utf_16 else "utf-8-sig", errors="replace" if utf_16 else "surrogateescape")


def _find(name: str, folders: list[Path]) -> Path | None:
    """The first file of that name in the folders."""
    for folder in folders:
        try:
            if (folder / name).is_file():
                return folder / name
        except (OSError, ValueError):  # not the name of a file: too long, or with a null byte
            return None
    return None


@contextmanager
def _file_resolver(folder: Path) -> Iterator[mi.FileResolver]:
    """Look for files in a folder first, as Mitsuba does while it loads a scene; scenes add folders by ``<path>``."""
    before = mi.file_resolver()
    resolver = mi.FileResolver(before)
    resolver.prepend(str(folder))
    mi.set_file_resolver(resolver)
    try:
        yield resolver
    finally:
        mi.set_file_resolver(before)
