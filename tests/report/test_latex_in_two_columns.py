"""Tables and figures of whole reports in an article of two columns, compiled by pdflatex."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from evoexp.report.pages.latex_tables import PACKAGES
from report_samples import smoke_report

pytestmark = [
    pytest.mark.matrix,
    pytest.mark.skipif(shutil.which("pdflatex") is None, reason="needs pdflatex"),
]

WIDEST = 1.0  # [pt] that a line may be too wide


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Return the lines that show every table and every figure of two reports."""
    outputs = tmp_path_factory.mktemp("outputs")
    lines = []
    for name in ("curkovic_methods", "corsepius"):
        report = smoke_report(outputs, name, formats=("pdf",), width="column")
        tables, figures = sorted(report.glob("table_*.tex")), sorted(report.glob("*.pdf"))
        assert len(tables) > 6 and len(figures) > 1
        # LaTeX keeps a limited number of floats for later pages
        lines += [rf"\input{{{path}}}\clearpage" for path in tables]
        for path in figures:
            picture = rf"\includegraphics[width=\linewidth]{{{path}}}"
            lines += [r"\begin{figure}", picture, r"\end{figure}", r"\clearpage"]
    return lines


def log_of(paper: str, parts: list[str], folder: Path) -> str:
    """Return the log of an article of two columns; it has a page for each of its parts."""
    head = [rf"\documentclass[twocolumn,{paper}]{{article}}", r"\usepackage{graphicx}", PACKAGES]
    text = [*head, r"\begin{document}", *parts, r"\end{document}", ""]
    (folder / "article.tex").write_text("\n".join(text))
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "article.tex"]
    done = subprocess.run(command, cwd=folder, capture_output=True, timeout=200)
    log = (folder / "article.log").read_text(errors="replace")
    assert done.returncode == 0, log[-2000:]
    return log


@pytest.mark.parametrize("paper", ["letterpaper", "a4paper"])
def test_every_table_and_figure_fits(paper: str, parts: list[str], tmp_path: Path) -> None:
    log = log_of(paper, parts, tmp_path)
    wide = re.findall(r"Overfull \\hbox \(([\d.]+)pt too wide\)", log)
    assert all(float(width) <= WIDEST for width in wide), wide
    assert "Float too large" not in log and r"Overfull \vbox" not in log


def test_a_line_that_is_too_wide_is_noticed(tmp_path: Path) -> None:
    log = log_of("a4paper", [r"\noindent\rule{300pt}{1pt}"], tmp_path)
    assert r"Overfull \hbox" in log
