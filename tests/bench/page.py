# SPDX-License-Identifier: GPL-3.0-or-later
"""The Markdown report and the plots as one HTML page."""

from __future__ import annotations

import html as escape

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2rem auto; max-width: 80rem; padding: 0 1rem; color: #222 }
table { border-collapse: collapse; font-size: 12px; display: block; overflow-x: auto }
th, td { padding: .15rem .5rem; border-bottom: 1px solid #ddd; text-align: right; white-space: nowrap }
th:first-child, td:first-child, th:nth-child(2), td:nth-child(2) { text-align: left }
th { background: #f4f4f4 } img { max-width: 100% } tr:hover td { background: #fafae8 }
"""


def _inline(text: str) -> str:
    text = escape.escape(text, quote=False)
    for mark, tag in (("**", "b"), ("*", "i")):
        parts = text.split(mark)
        if len(parts) % 2:
            text = "".join(part if i % 2 == 0 else f"<{tag}>{part}</{tag}>" for i, part in enumerate(parts))
    return text


def html(markdown: str, pictures: list[str]) -> str:
    """Headings, paragraphs, lists and tables of the report; the plots after its first paragraphs."""
    body, rows = [], []
    shown = False

    def close_table() -> None:
        if rows:
            head, rest = rows[0], rows[2:]
            body.append("<table><tr>" + "".join(f"<th>{_inline(cell)}</th>" for cell in head) + "</tr>")
            body.extend("<tr>" + "".join(f"<td>{_inline(cell)}</td>" for cell in row) + "</tr>" for row in rest)
            body.append("</table>")
            rows.clear()

    for line in markdown.splitlines():
        if line.startswith("|"):
            rows.append([cell.strip() for cell in line.strip("|").split("|")])
            continue
        close_table()
        if line.startswith("#"):
            level = len(line) - len(line.lstrip("#"))
            if level == 2 and not shown:
                body.extend(f'<p><img src="{name}" alt="{name}"></p>' for name in pictures)
                shown = True
            body.append(f"<h{level}>{_inline(line.lstrip('# '))}</h{level}>")
        elif line.startswith("- "):
            body.append(f"<li>{_inline(line[2:])}</li>")
        elif line:
            body.append(f"<p>{_inline(line)}</p>")
    close_table()
    return ('<!doctype html><html lang="en"><meta charset="utf-8"><title>Patina: bench</title>'
            f"<style>{STYLE}</style>\n" + "\n".join(body) + "\n</html>\n")
