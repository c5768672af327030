"""Option files from elsewhere unfold to little, read no environment and run no code."""

import os
from pathlib import Path

import pytest

from confinement import confined, no_longer
from evoexp.configuration import compose
from evoexp.configuration.refusals import check_file
from evoexp.configuration.search_path import searched_first
from evoexp.errors import EvoexpError

BASE = "experiment=rana_obstacles"
NAMES = "abcdefghi"
LAUGHS = "a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n" + "".join(
    f"{new}: &{new} [{', '.join([f'*{old}'] * 10)}]\n"
    for old, new in zip(NAMES, NAMES[1:], strict=False)
)
GA = "_target_: genetic\npopulation_size: 8\nnum_generations: 2\nnum_elites: 1\n"
RATES = "crossover_rate: 0.5\nmutation_rate: 0.5\n"
HOSTILE = {
    "aliases that unfold": (LAUGHS, "at most 100,000 values, aliases unfolded"),
    "aliases as keys": (LAUGHS.replace("i: &i", "<<: &i"), "at most 100,000 values"),
    "a large file": ("x: " + "y" * 2_000_000, "larger than 1 mb"),
    "an alias of itself": ("a: &a [*a]\n", "at most 100,000 values"),
    "nested deeply": ("a: " + "[" * 20_000 + "]" * 20_000, "50 deep"),
    "code": (
        "x: !!python/object/apply:os.system ['touch harm']\n",
        "could not determine a constructor",
    ),
    "code by name": ("_target_: os.system\ncommand: touch harm\n", "a registered component"),
    "the environment": (f"{GA}{RATES}x: ${{oc.env:SECRET}}\n", "no function, as oc.env is"),
    "the environment in words": (f"{GA}{RATES}x: a${{oc.env:SECRET}}b\n", "no function"),
    "the environment by a function": (
        f"{GA}{RATES}x: ${{oc.decode:${{oc.env:SECRET}}}}\n",
        "no function",
    ),
    "a device": ("/dev/zero", "no option 'mine'"),
}


def refusal(folder: Path) -> str:
    """Return the refusal of the option `ga=mine` of a folder."""
    try:
        with no_longer(), searched_first([str(folder)]):
            compose.expand([BASE, "budget=smoke", "ga=mine"])
    except EvoexpError as error:
        text = str(error)
        assert "\n" not in text and len(text) < 1500
        return text
    return ""


@pytest.mark.parametrize("name", HOSTILE)
def test_an_option_that_harms_is_refused(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SECRET", "hush")
    text, reason = HOSTILE[name]
    (tmp_path / "ga").mkdir()
    if text.startswith("/dev"):
        os.symlink(text, tmp_path / "ga" / "mine.yaml")
    else:
        (tmp_path / "ga" / "mine.yaml").write_text(text)
    found = confined(lambda: refusal(tmp_path), tmp_path, 500)
    assert reason in found
    assert "hush" not in found
    assert not (tmp_path / "harm").exists()


def test_an_alias_counts_as_what_it_names_alone(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    many = f"x: [{', '.join('1' * 20_000)}]\n"
    path.write_text(f"{many}a: &a [1, 2]\nb: [*a, *a, *a, *a, *a]\n")
    check_file(path)
    path.write_text(f"a: &a [{', '.join('1' * 20_000)}]\nb: [*a, *a, *a, *a, *a]\n")
    with pytest.raises(EvoexpError, match="at most 100,000 values, aliases unfolded"):
        check_file(path)


def test_nothing_of_the_environment_enters_by_an_override(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SECRET", "hush")
    with pytest.raises(EvoexpError, match="no function, as oc.env is") as caught:
        compose.expand([BASE, "budget=smoke", "scenario.length_unit=${oc.env:SECRET}"])
    assert "hush" not in str(caught.value)
