r"""Tables as LaTeX, for `\input` in a paper; they need `\usepackage{booktabs}`."""

import re

from evoexp.report.page_text import Document, Section, TableText

LONG_TEXT = 30  # letters of a cell, from which on its column breaks lines
LINE = 0.95  # [-] of the width of the text, shared by columns that break lines
_SIGNS = {
    "\\": r"\textbackslash{}",
    "{": r"\{",
    "}": r"\}",
    "$": r"\$",
    "&": r"\&",
    "#": r"\#",
    "_": r"\_",
    "%": r"\%",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    "[": "{[}",  # behind the end of a line it would begin an option
    "*": "{*}",
    "–": "--",
    "−": "$-$",
    "∞": r"$\infty$",
    "≥": r"$\geq$",
    "≤": r"$\leq$",
    "≈": r"$\approx$",
    "·": r"$\cdot$",
    "×": r"$\times$",
    "→": r"$\rightarrow$",
    "°": r"$^\circ$",
    "√": r"$\surd$",
    "…": r"\dots{}",
    "“": "``",
    "”": "''",
    "’": "'",
}
_GREEK = {
    "α": "alpha",
    "β": "beta",
    "γ": "gamma",
    "δ": "delta",
    "ε": "varepsilon",
    "ζ": "zeta",
    "η": "eta",
    "θ": "theta",
    "ι": "iota",
    "κ": "kappa",
    "λ": "lambda",
    "μ": "mu",
    "ν": "nu",
    "ξ": "xi",
    "π": "pi",
    "ρ": "rho",
    "σ": "sigma",
    "τ": "tau",
    "φ": "varphi",
    "χ": "chi",
    "ψ": "psi",
    "ω": "omega",
    "Δ": "Delta",
    "Θ": "Theta",
    "Λ": "Lambda",
    "Σ": "Sigma",
    "Φ": "Phi",
    "Ψ": "Psi",
    "Ω": "Omega",
}
_SIGNS |= {letter: rf"$\{name}$" for letter, name in _GREEK.items()}
_SIGNS |= {sign: f"$_{k}$" for k, sign in enumerate("₀₁₂₃₄₅₆₇₈₉")}
_SIGNS |= {sign: f"$^{k}$" for k, sign in zip("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹", strict=True)}


def escaped(text: str) -> str:
    """Return a text that LaTeX prints as it is."""
    return "".join(_SIGNS.get(sign, sign) for sign in " ".join(text.split()))


def latex_tables(document: Document) -> dict[str, bytes]:
    """Return the tables of a page, by the names of their files."""
    return {
        section.table.file: _latex(section, section.table, document).encode()
        for section in document.sections
        if section.table and section.table.file
    }


def _latex(section: Section, table: TableText, document: Document) -> str:
    lines = [
        f"% made by {' '.join(document.command.split())}",
        f"% runs: {', '.join(run.hash12 for run in document.runs)}",
        r"\begin{table}",
        r"\centering\small",
        rf"\caption{{{escaped(_caption(section, table, document))}}}",
        rf"\label{{tab:{_label(section, document)}}}",
        rf"\begin{{tabular}}{{{_columns(table)}}}",
        r"\toprule",
        " & ".join(map(_cell, table.headers)) + r" \\",
        r"\midrule",
        *(" & ".join(map(_cell, row)) + r" \\" for row in table.rows),
        r"\bottomrule",
        r"\end{tabular}",
        r"\end{table}",
        "",
    ]
    return "\n".join(lines)


def _caption(section: Section, table: TableText, document: Document) -> str:
    """Return the heading, the note, and whose runs these are."""
    note = f" {table.note}" if table.note else ""
    return f"{document.title}: {section.heading}.{note} {document.provenance}".replace("`", "")


def _label(section: Section, document: Document) -> str:
    words = f"{document.experiment or document.runs[0].hash12} {section.heading}"
    return "-".join(re.findall("[a-z0-9]+", words.lower()))


def _columns(table: TableText) -> str:
    """Return how columns stand: numbers to the right, long texts as paragraphs."""
    cells = [[_plain(row[k]) for row in table.rows] for k in range(len(table.headers))]
    longest = [max(map(len, column), default=0) for column in cells]
    wide = {k: size for k, size in enumerate(longest) if size > LONG_TEXT}
    share = LINE / (len(wide) + 0.3 * (len(longest) - len(wide))) if wide else 0.0
    kinds = []
    for k, column in enumerate(cells):
        if k in wide:
            kinds.append(rf"p{{{share:.2f}\linewidth}}")
        else:
            is_number = all(cell[:1] in "0123456789−–∞" for cell in column if cell)
            kinds.append("r" if k and is_number else "l")
    return "".join(kinds)


def _cell(value: object) -> str:
    return escaped(_plain(value))


def _plain(value: object) -> str:
    return str(getattr(value, "text", value)).replace("`", "")
