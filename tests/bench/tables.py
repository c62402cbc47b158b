# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows of a run, and tables of them as Markdown."""

from __future__ import annotations

from typing import Any

Row = dict[str, Any]


def table(head: list[str], rows: list[list[str]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def count(points: int) -> str:
    if points >= 1_000_000:
        return f"{points / 1e6:.3g}M"
    return f"{points / 1e3:.3g}k" if points >= 1000 else str(points)


def name_of(row: Row) -> str:
    threads = f", {row['threads']} threads" if row["threads"] > 1 else ", 1 thread" if row["threads"] else ""
    return f"{row.get('device_name', row['device'])}{threads}"


def joined(result: dict[str, Any], *groups: str) -> list[Row]:
    """Rows with their details, of some groups or all."""
    rows = [{**detail, **row} for row, detail in zip(result["rows"], result["details"])]
    return [row for row in rows if not groups or row["group"] in groups]
