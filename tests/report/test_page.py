import base64
import html.parser
import json
import re

import pytest

from voroquad import cli
from voroquad.report.page import LARGEST_SVG, write_report
from voroquad.results.manifest import Figure, ImageGrid, Results, Section, Table

PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 2 1"><rect width="2" height="1"/></svg>'
CSV = "method,mse\nuniform,1e-2\nSobol',3e-10\nHalton,0.0001234567890\nstratified,2e-3\n"


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / "results"
    path.mkdir()
    (path / "a.png").write_bytes(PNG)
    (path / "a.svg").write_text(SVG, encoding="utf-8")
    (path / "a.csv").write_text(CSV, encoding="utf-8")
    (path / "b.csv").write_text(CSV, encoding="utf-8")
    Results(
        "A <run> & more",
        "voroquad study -o out",
        [
            Section(
                "First",
                "Text with <b>",
                figures=[
                    Figure("a.png", "Caption", "Alternative", svg="a.svg", csv="b.csv"),
                    Figure("a.png", "Other", "Bitmap", csv="a.csv"),
                ],
                tables=[Table("a.csv", "Errors.")],
                grids=[ImageGrid(["plain"], ["16 spp", "64 spp"], [["a.png", None]], "Images.")],
            )
        ],
    ).write(path)
    return path


class Page(html.parser.HTMLParser):
    """All tags of a page, and its text."""

    def __init__(self, path):
        super().__init__()
        self.tags, self.text = [], ""
        self.source = path.read_text(encoding="utf-8")
        self.feed(self.source)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data):
        self.text += data

    def all(self, tag):
        return [attributes for name, attributes in self.tags if name == tag]


def decoded(uri):
    return base64.b64decode(uri.split("base64,")[1])


def test_everything_is_inside_the_page(folder, tmp_path):
    page = Page(write_report([folder], tmp_path / "page" / "index.html"))
    for _, attributes in page.tags:
        for name in ("src", "href"):
            assert re.match(r"data:|#", attributes.get(name) or "#")
    assert not re.search(r"https?://|@import|url\((?!\"data:)", page.source)
    (policy,) = (m["content"] for m in page.all("meta") if m.get("http-equiv") == "Content-Security-Policy")
    assert "default-src 'none'" in policy
    pictures = page.all("img")
    assert [p["alt"] for p in pictures] == ["Alternative", "Bitmap", "plain, 16 spp"]
    assert decoded(pictures[0]["src"]) == SVG.encode()
    assert decoded(pictures[1]["src"]) == PNG
    downloads = [a for a in page.all("a") if "download" in a]
    assert [a["download"] for a in downloads] == ["b.csv", "b.json", "a.csv", "a.json", "a.csv", "a.json"]
    assert decoded(downloads[0]["href"]).decode() == CSV
    assert json.loads(decoded(downloads[1]["href"]))[2] == {"method": "Halton", "mse": 0.000123456789}
    assert page.source.count("<tbody>") == 3  # two tables of numbers and the images; a figure's table is not repeated


def test_a_number_that_is_not_known(folder):
    (folder / "a.csv").write_text("method,mse\nuniform,0.5\nHalton,\n", encoding="utf-8")
    page = Page(write_report([folder]))
    (link,) = {a["href"] for a in page.all("a") if a.get("download") == "a.json"}
    assert json.loads(decoded(link)) == [{"method": "uniform", "mse": 0.5}, {"method": "Halton", "mse": None}]
    assert "number" in [th.get("class") for th in page.all("th")]  # the column still sorts as numbers


def test_where_the_page_goes(folder, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for folders, page in (([folder], folder / "index.html"), ([folder, folder], tmp_path / "index.html")):
        monkeypatch.setattr("sys.argv", ["voroquad", "report", *map(str, folders)])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        assert stop.value.code in (None, 0)
        assert page.is_file()
        assert page.samefile(capsys.readouterr().out.strip())


def test_results_of_an_older_version_still_open(folder):
    raw = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    for section in raw["sections"]:
        del section["comparisons"]
        for figure in section["figures"]:
            for key in ("plots", "series", "lines"):
                del figure[key]
    (folder / "results.json").write_text(json.dumps(raw), encoding="utf-8")
    assert Page(write_report([folder])).text.count("Caption") == 1


def test_text_is_text(folder, tmp_path):
    page = Page(write_report([folder], tmp_path / "index.html"))
    for text in (
        "A <run> & more",
        "voroquad study -o out",
        "Text with <b>",
        "Caption",
        "Errors.",
        "Images.",
        "3e-10",
        "0.00012346",
    ):
        assert text in page.text
    assert page.all("b") == []


def test_links_lead_somewhere(folder, tmp_path):
    page = Page(write_report([folder, folder], tmp_path / "index.html", title="Two"))
    targets = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
    assert len(targets) == len(set(targets)) == 5
    assert {a["href"][1:] for a in page.all("a") if a["href"].startswith("#")} == set(targets)


def test_a_large_svg_gives_way_to_its_png(folder, tmp_path):
    (folder / "a.svg").write_text(SVG + " " * LARGEST_SVG, encoding="utf-8")
    page = Page(write_report([folder], tmp_path / "index.html"))
    assert decoded(page.all("img")[0]["src"]) == PNG


def damage_missing(folder):
    (folder / "a.csv").unlink()


def damage_ragged(folder):
    (folder / "a.csv").write_text("a,b\n1\n", encoding="utf-8")


def damage_json(folder):
    (folder / "results.json").write_text(json.dumps({"title": "x"}), encoding="utf-8")


def damage_all(folder):
    (folder / "results.json").unlink()


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (damage_missing, "a.csv is missing; make the folder again: voroquad study"),
        (damage_ragged, "rows longer or shorter"),
        (damage_json, "is damaged"),
        (damage_all, "holds no results.json; run 'voroquad study'"),
    ],
)
def test_bad_folders_are_one_line(folder, tmp_path, monkeypatch, capsys, damage, message):
    damage(folder)
    output = tmp_path / "index.html"
    monkeypatch.setattr("sys.argv", ["voroquad", "report", str(folder), "-o", str(output)])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    assert stop.value.code == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not output.exists()


def test_no_folder():
    with pytest.raises(ValueError, match="name at least one folder"):
        write_report([], "index.html")
