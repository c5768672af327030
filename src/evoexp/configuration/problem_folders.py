"""Folders of problems as MoveIt writes them: `scenario.folder=…`, a condition per problem.

A problem is a `scene0001.yaml` beside a `request0001.yaml`; a folder may also hold folders of
problems, as the data set MotionBenchMaker does.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from evoexp.attachments import located
from evoexp.configuration.overrides import Choice, Override, Value
from evoexp.errors import SettingError

FOLDER, SCENE, REQUEST = "scenario.folder", "scenario.scene", "scenario.request"
MOST_PROBLEMS = 10_000  # conditions of one call


class ProblemFiles(NamedTuple):
    """A problem of a folder."""

    name: str  # the folder's name and the number: `box_panda 0001`
    scene: Path  # path of the planning scene
    request: Path  # path of the motion plan request


def problem_choices(choice: Choice) -> Iterator[tuple[str, Choice]]:
    """Yield label and overrides of every problem of a folder; without one, the overrides as given.

    Raises:
        SettingError: If the folder holds no problem, or a scene is named beside it.
    """
    if FOLDER not in choice:
        yield "", choice
        return
    given = choice[FOLDER]
    folder = str(given.values[0].data) if given.values else ""
    for key in (SCENE, REQUEST):
        if key in choice:
            raise SettingError(key, f"left out beside {FOLDER}", choice[key].text)
    rest = {key: override for key, override in choice.items() if key != FOLDER}
    for problem in problems(folder):
        files = {SCENE: str(problem.scene), REQUEST: str(problem.request)}
        yield problem.name, rest | {key: _setting(key, path) for key, path in files.items()}


def problems(folder: str) -> list[ProblemFiles]:
    """Return the problems of a folder, and of the folders in it, in the order of their names.

    Raises:
        SettingError: If there are none or too many, or a scene has no request.
    """
    root = Path(located(folder))
    if "\0" in folder or not root.is_dir():
        raise SettingError(FOLDER, "a folder of problems", folder)
    found = []
    for scene in sorted([*root.glob("scene*.yaml"), *root.glob("*/scene*.yaml")]):
        number = scene.stem.removeprefix("scene")
        request = scene.with_name(f"request{number}.yaml")
        if not request.is_file():
            raise SettingError(FOLDER, f"a folder with {request.name} beside every scene", folder)
        name = f"{scene.resolve().parent.name} {number}".strip()
        found.append(ProblemFiles(name, scene, request))
    if not found or len(found) > MOST_PROBLEMS:
        must = f"a folder of 1 to {MOST_PROBLEMS:,} problems (scene0001.yaml, request0001.yaml, …)"
        raise SettingError(FOLDER, must, f"{folder} with {len(found) or 'none'}")
    return found


def _setting(key: str, path: str) -> Override:
    return Override("", key, (Value(path, path),), False, f"{key}={path}")
