from math import inf, nan

import pytest

from evoexp.report.pages import markdown


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (-0.0, "0"),
        (-3.0, "−3"),
        (123456.0, "123456"),
        (123456.7, "1.235e+05"),
        (-1e-9, "−1e−09"),
        (nan, "–"),
        (inf, "∞"),
        (-inf, "−∞"),
    ],
)
def test_numbers_have_four_digits_or_are_whole(value: float, text: str) -> None:
    assert markdown.number(value) == text
