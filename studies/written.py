"""The tables of a report as CSV, Markdown and LaTeX."""

import csv
import io
import math
from typing import Any

from studies.report import Report, Table, limits_of
from studies.statistics import Interval

DIGITS = 4
LATEX = {
    "\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_", "{": r"\{",
    "}": r"\}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "²": r"\textsuperscript{2}",
}  # fmt: skip


def as_csv(table: Table) -> str:
    """One table with full precision; an interval takes three columns, of which two end in low and high."""
    wide = [
        any(isinstance(row[k], Interval) for row in table.rows) for k in range(len(table.heads))
    ]  # fmt: skip
    heads = []
    for head, three in zip(table.heads, wide, strict=True):
        heads += [head, f"{head} low", f"{head} high"] if three else [head]
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(heads)
    for row in table.rows:
        cells: list[Any] = []
        for cell, three in zip(row, wide, strict=True):
            cells += list(limits_of(cell)) if three else [cell]
        writer.writerow(["" if cell is None else cell for cell in cells])
    return out.getvalue()


def as_markdown(made: Report) -> str:
    """All tables under the title of the study, with what a reader must know."""
    parts = [f"# {made.title}", *(f"Note: {note}." for note in made.notes)]
    for table in made.tables:
        lines = ["| " + " | ".join(table.heads) + " |", "|---" * len(table.heads) + "|"]
        lines += ["| " + " | ".join(_cell(cell) for cell in row) + " |" for row in table.rows]
        parts += [f"## {table.title}", "\n".join(lines)]
    return "\n\n".join(parts) + "\n"


def as_latex(made: Report) -> str:
    """All tables for LaTeX with booktabs."""
    parts = ["% \\usepackage{booktabs}"]
    for table in made.tables:
        body = [" & ".join(map(_latex, table.heads)) + r" \\", r"\midrule"]
        body += [" & ".join(_latex(_cell(cell)) for cell in row) + r" \\" for row in table.rows]
        parts.append(
            "\n".join(
                [r"\begin{table}", r"\centering", rf"\caption{{{_latex(f'{made.title}. {table.title}.')}}}",
                 rf"\label{{tab:{table.name.replace('_', '-')}}}",
                 rf"\begin{{tabular}}{{{_alignment(table)}}}", r"\toprule", *body, r"\bottomrule",
                 r"\end{tabular}", r"\end{table}"]
            )
        )  # fmt: skip
    return "\n\n".join(parts) + "\n"


def _alignment(table: Table) -> str:
    return "".join(
        "l" if all(isinstance(row[k], str) for row in table.rows) else "r" for k in range(len(table.heads))
    )


def _cell(cell: Any) -> str:
    if cell is None:
        return ""
    if isinstance(cell, Interval):
        value, low, high = limits_of(cell)
        return _number(value) if low is None else f"{_number(value)} [{_number(low)}, {_number(high)}]"
    return _number(cell) if isinstance(cell, float) else str(cell)


def _number(value: float) -> str:
    if math.isnan(value):
        return ""
    text = f"{value:.{DIGITS}g}"
    return f"{value:.0f}" if "e+" in text else text


def _latex(text: str) -> str:
    return "".join(LATEX.get(letter, letter) for letter in text)
