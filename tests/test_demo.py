import pytest

from voroquad import cli, demo
from voroquad.study import figures_bins, run

pytest.importorskip("mitsuba", exc_type=ImportError)


def test_demo_ends_with_the_page(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(figures_bins, "REPETITIONS", 10)
    monkeypatch.setattr(run, "_TALK", {"bins": run._TALK["bins"]})
    monkeypatch.setattr(demo, "REPLICATES", 2)
    monkeypatch.setattr(demo, "MAX_N", 32)
    monkeypatch.setattr(run, "_DIMENSIONS", [(methods, f[:1]) for methods, f in run._DIMENSIONS[1:]])
    monkeypatch.setattr(demo, "SIZE", (24, 16))
    monkeypatch.setattr(demo, "SPP", (4, 16))
    monkeypatch.setattr("sys.argv", ["voroquad", "demo", "-o", str(tmp_path / "out")])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    assert stop.value.code in (None, 0)
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"index.html", "study", "depth-of-field"}
    page = tmp_path / "out" / "index.html"
    assert capsys.readouterr().out.splitlines()[-1] == str(page)
    text = page.read_text(encoding="utf-8")
    assert text.count("<img ") >= 4  # a figure each
    assert text.count('class="comparison"') == 1
