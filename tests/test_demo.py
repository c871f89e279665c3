import functools

import pytest

from voroquad import cli, demo
from voroquad.report.page import live_figure

pytest.importorskip("mitsuba", exc_type=ImportError)
from voroquad.mitsuba import compare


def test_demo_ends_with_the_page(tmp_path, monkeypatch):
    """With one method beside the first, as each takes seconds to compile."""
    monkeypatch.setattr(compare, "compare", functools.partial(compare.compare, methods=["stratified-w"]))
    page = demo.run_demo(
        tmp_path / "out",
        replicates=2,
        max_n=32,
        figures=["cells", "mse-smooth-2d"],
        size=(24, 16),
        spp=(4, 16),
        show_progress=False,
    )
    assert page == tmp_path / "out" / "index.html"
    assert {p.name for p in page.parent.iterdir()} == {"index.html", "study", "depth-of-field"}
    text = page.read_text(encoding="utf-8")
    assert text.count("<img ") >= 3  # a figure each
    assert text.count('class="comparison"') == 1
    assert ("<iframe " in text) == bool(live_figure())


def test_the_command_prints_the_page(monkeypatch, tmp_path, capsys):
    seen = []
    monkeypatch.setattr(demo, "run_demo", lambda out, **options: seen.append((out, options)) or out / "index.html")
    monkeypatch.setattr("sys.argv", ["voroquad", "demo", "-o", str(tmp_path), "--seed", "3"])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    assert stop.value.code in (None, 0)
    assert seen == [(tmp_path, {"seed": 3})]
    assert capsys.readouterr().out == f"{tmp_path / 'index.html'}\n"
