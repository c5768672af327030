"""Folders of problems as MoveIt writes them: `scenario.folder=…`, a condition per problem.

A problem is a `scene0001.yaml` beside a `request0001.yaml`; a folder may also hold folders of
problems, as the data set MotionBenchMaker does.
"""

from collections.abc import Iterator
from pathlib import Path

from evoexp.attachments import located
from evoexp.configuration.overrides import Choice, Override, Value
from evoexp.errors import SettingError

FOLDER, SCENE, REQUEST = "scenario.folder", "scenario.scene", "scenario.request"
MOST_PROBLEMS = 10_000  # conditions of one call


def problem_choices(choice: Choice) -> Iterator[tuple[str, Choice]]:
    """Yield label and overrides of every problem of a folder; without one, the overrides as given.

    A label is the folder's name and the number, `box_panda 0001`; problems come in the order of the
    paths of their scenes.
    """
    if FOLDER not in choice:
        yield "", choice
        return
    for key in (SCENE, REQUEST):
        if key in choice:
            raise SettingError(key, f"left out beside {FOLDER}", choice[key].text)
    folder = "".join(str(value.data) for value in choice[FOLDER].values)
    root = Path(located(folder))
    if "\0" in folder or not root.is_dir():
        raise SettingError(FOLDER, "a folder of problems", folder)
    scenes = sorted([*root.glob("scene*.yaml"), *root.glob("*/scene*.yaml")])
    if not scenes or len(scenes) > MOST_PROBLEMS:
        must = f"a folder of 1 to {MOST_PROBLEMS:,} problems (scene0001.yaml, request0001.yaml, …)"
        raise SettingError(FOLDER, must, f"{folder} with {len(scenes) or 'none'}")
    rest = {key: override for key, override in choice.items() if key != FOLDER}
    for scene in scenes:
        number = scene.stem.removeprefix("scene")
        request = scene.with_name(f"request{number}.yaml")
        if not request.is_file():
            raise SettingError(FOLDER, f"a folder with {request.name} beside every scene", folder)
        files = {}
        for key, path in ((SCENE, str(scene)), (REQUEST, str(request))):
            files[key] = Override("", key, (Value(path, path),), False, f"{key}={path}")
        yield f"{scene.resolve().parent.name} {number}".strip(), rest | files
