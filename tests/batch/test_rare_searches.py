"""Workers look for garbage as rarely as their parent does."""

import subprocess
import sys

from evoexp.batch import workers
from evoexp.numeric.garbage import NEW_OBJECTS


def test_the_server_looks_less_before_it_loads_anything() -> None:
    code = "import gc, sys, {}; print(gc.get_threshold()[0], 'numpy' in sys.modules)"
    first = workers._RARE_SEARCHES
    said = subprocess.run(
        [sys.executable, "-c", code.format(first)], capture_output=True, text=True, check=True
    ).stdout.split()
    assert said == [str(NEW_OBJECTS), "False"]


def test_workers_do_not_look_through_what_the_server_loaded() -> None:
    code = "import gc, sys, {}; print(gc.get_freeze_count() > len(sys.modules))"
    for module, is_frozen in ((workers._RARE_SEARCHES, False), (workers._PRELOADED, True)):
        said = subprocess.run(
            [sys.executable, "-c", code.format(module)], capture_output=True, text=True, check=True
        ).stdout.split()
        assert said == [str(is_frozen)]
