"""Pieces of an HTML page that needs no other file: texts are escaped, pictures are part of it."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path

REPORT_FILE = "report.html"
PAGE_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #222; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }
h1 { margin-bottom: 0.2rem; } h2 { margin-top: 2.2rem; border-bottom: 1px solid #ddd; }
table { border-collapse: collapse; margin: 0.8rem 0; }
td, th { padding: 0.2rem 0.9rem 0.2rem 0; text-align: left; border-bottom: 1px solid #eee; }
td.number { text-align: right; font-variant-numeric: tabular-nums; }
.ok { color: #00795a; } .bad { color: #b33c00; } .status { font-weight: 600; }
.pictures { display: grid; grid-template-columns: repeat(auto-fit, minmax(24rem, 1fr)); gap: 1rem; }
figure { margin: 0; } img { width: 100%; border: 1px solid #eee; } figcaption { font-size: 0.85rem; color: #555; }
.bar { background: #0072b2; height: 0.9rem; } .scale { width: 22rem; background: #f2f2f2; }
pre { background: #f7f7f7; padding: 0.8rem; overflow-x: auto; font-size: 0.85rem; }
"""


def page(title: str, sections: Iterable[str]) -> str:
    """The whole document."""
    head = f'<meta charset="utf-8"><title>{escape(title)}</title><style>{PAGE_STYLE}</style>'
    body = "\n".join(section for section in sections if section)
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head>\n<body>\n{body}\n</body></html>\n'


def heading(text: str) -> str:
    return f"<h1>{escape(text)}</h1>"


def section(title: str, *content: str) -> str:
    """A heading with its content; empty without content."""
    inner = "\n".join(text for text in content if text)
    return f"<h2>{escape(title)}</h2>\n{inner}" if inner else ""


def paragraph(text: str, kind: str = "") -> str:
    return f'<p class="{kind}">{escape(text)}</p>' if text else ""


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Numbers stand to the right; a cell (text, class) has a class of PAGE_STYLE."""
    lines = ["".join(_cell(cell) for cell in row) for row in rows]
    if not lines:
        return ""
    top = "".join(f"<th>{escape(name)}</th>" for name in head)
    return f"<table><tr>{top}</tr>" + "".join(f"<tr>{line}</tr>" for line in lines) + "</table>"


def _cell(value: object) -> str:
    text, kind = value if isinstance(value, tuple) else (value, "")
    if isinstance(text, float | int) and not isinstance(text, bool):
        text, kind = f"{text:.6g}", kind or "number"
    return f'<td class="{kind}">{escape(str(text))}</td>'


def bars(parts: Mapping[str, float], unit: str) -> str:
    """Parts of a whole, the largest first, as bars with their share."""
    whole = sum(parts.values()) or 1.0
    lines = []
    for name, value in sorted(parts.items(), key=lambda part: -part[1]):
        share = 100 * value / whole
        bar = f'<div class="scale"><div class="bar" style="width: {share:.1f}%"></div></div>'
        numbers = f'<td class="number">{value:.3g} {escape(unit)}</td><td class="number">{share:.0f} %</td>'
        lines.append(f"<tr><td>{escape(name)}</td><td>{bar}</td>{numbers}</tr>")
    return f"<table>{''.join(lines)}</table>" if lines else ""


def pictures(files: Iterable[Path]) -> str:
    """PNG and GIF files with their names, in two columns in wide windows."""
    figures = []
    for file in files:
        data = b64encode(file.read_bytes()).decode("ascii")
        name = escape(file.stem.replace("_", " "))
        source = f"data:image/{file.suffix[1:]};base64,{data}"
        figures.append(f'<figure><img alt="{name}" src="{source}"><figcaption>{name}</figcaption></figure>')
    return f'<div class="pictures">{"".join(figures)}</div>' if figures else ""


def preformatted(text: str) -> str:
    """Preformatted text."""
    return f"<pre>{escape(text)}</pre>" if text else ""


def folded(title: str, text: str) -> str:
    """A long text that the reader can expand."""
    return f"<details><summary>{escape(title)}</summary>{preformatted(text)}</details>" if text else ""
