"""Settings that no planner takes are refused in one line that names the field."""

import shlex
from pathlib import Path

import pytest
import yaml

from composed import composed
from evoexp.errors import EvoexpError
from planners.runs import ran

TESTS = Path(__file__).parents[1]
LINES: dict[str, dict[str, str]] = yaml.safe_load(
    Path(__file__).with_name("refused_conditions.yaml").read_text()
)


@pytest.mark.examples(40)
@pytest.mark.parametrize(
    ("condition", "words", "message"),
    [(condition, *line) for condition, lines in LINES.items() for line in lines.items()],
)
def test_what_cannot_be_is_refused_in_one_line(condition: str, words: str, message: str) -> None:
    chosen, _, label = condition.partition(": ")
    if chosen and "=" not in chosen:
        chosen = f"experiment={chosen}"
    given = f"{chosen} {words}".replace("TESTS", str(TESTS))
    with pytest.raises(EvoexpError) as refusal:
        ran(composed(*shlex.split(given), label=label))
    assert message in str(refusal.value) and "\n" not in str(refusal.value)
