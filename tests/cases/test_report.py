"""`fsci report`: one page of a run that needs no other file, read back by a parser."""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import pytest
from programs import fsci
from small_cases import PLATE

from fsci.report.html import bars, page, section, table
from fsci.report.report import report

VOID = {"meta", "img", "br"}


class Page(HTMLParser):
    """Headings, texts and pictures of a page; a tag that is closed wrongly is an error."""

    def __init__(self, text: str):
        super().__init__()
        self.open: list[str] = []
        self.headings: list[str] = []
        self.texts: list[str] = []
        self.images: list[str] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        assert "href" not in found
        if tag == "img":
            self.images.append(found["src"])
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] == "h2":
            self.headings.append(data)
        if data.strip():
            self.texts.append(data.strip())


@pytest.fixture(scope="module")
def out(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("plate")
    checks = "verify: [{value: iterations, reference: 99, absolute: 1}, {value: residual, reference: 0, absolute: 1}]\n"
    probe = "probes: {tip: {quantity: displacement, at: [1, 1]}}\n"
    (folder / "case.yaml").write_text(f"title: a plate & <its> load\n{PLATE}{probe}{checks}")
    done = fsci("run", folder, "-o", folder / "out")
    assert done.returncode == 1, done.stderr
    return folder / "out"


def test_the_page_has_all_of_the_run(out):
    done = fsci("report", out)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == str(out / "report.html")
    text = (out / "report.html").read_text()
    found = Page(text)
    assert found.headings == ["Run", "Verification", "Pictures", "Curves", "Balances", "Probes", "Time", "Files"]
    assert {"a plate & <its> load", "finished", "missed", "ok", "iterations final", "tip.x", "solve", "other"} <= {
        *found.texts
    }
    assert "5, 0 repeated" in found.texts
    pictures = [base64.b64decode(source.removeprefix("data:image/png;base64,")) for source in found.images]
    assert len(pictures) == len(list((out / "pictures").glob("*.png")))
    assert all(data.startswith(b"\x89PNG") for data in pictures)


def test_a_failed_run_says_why(out):
    summary = json.loads((out / "summary.json").read_text())
    found = Page(report(out, {**summary, "status": "failed", "message": "step 3 <failed>"}, []))
    assert "step 3 <failed>" in found.texts
    assert "Pictures" not in found.headings


def test_a_new_run_removes_it(out):
    (out / "report.html").touch()
    assert fsci("run", out.parent, "-o", out, "--set", "verify=[]").returncode == 0
    assert not (out / "report.html").exists()


def test_a_folder_without_a_run(tmp_path):
    done = fsci("report", tmp_path)
    assert done.returncode == 2
    assert done.stderr == f"fsci report: '{tmp_path}' has no summary.json: no run has ended there\n"


def test_pieces():
    text = page("a < b", [section("empty"), section("A & B", table(("x",), [(("<i>", "ok"),), (1.5,)])), bars({}, "s")])
    found = Page(text)
    assert found.headings == ["A & B"]
    assert '<td class="ok">&lt;i&gt;</td>' in text
    assert '<td class="number">1.5</td>' in text
    assert Page(bars({"b": 1.0, "a": 3.0}, "s")).texts == ["a", "3 s", "75 %", "b", "1 s", "25 %"]


#: Written into the page: how many pictures are drawn, of how many, and whether the page is wider than its window.
COUNT = """<script>window.onload = () => {
  const pictures = [...document.images], shown = pictures.filter(one => one.naturalWidth > 0 && one.width > 0);
  const wide = document.documentElement.scrollWidth > window.innerWidth;
  document.body.dataset.shown = `${shown.length} of ${pictures.length}, ${wide ? "too wide" : "fits"}`;
}</script>"""


@pytest.mark.skipif(shutil.which("chromium") is None, reason="there is no chromium: apt-get install chromium")
def test_in_a_browser(out, tmp_path):
    """All pictures are drawn, the page fits into the window, and it asks for no other file."""
    assert fsci("report", out).returncode == 0
    text = (out / "report.html").read_text()
    count = len(Page(text).images)
    (tmp_path / "page.html").write_text(text.replace("</body>", f"{COUNT}</body>"))
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--window-size=1200,900", f"--user-data-dir={tmp_path}"]
    command = ["chromium", *options, "--virtual-time-budget=5000", "--dump-dom", f"file://{tmp_path / 'page.html'}"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    found = re.search(r'data-shown="([^"]*)"', done.stdout)
    assert found is not None, done.stderr[-2000:]
    assert count > 0
    assert found[1] == f"{count} of {count}, fits"
