"""Workers look for garbage as rarely as their parent does."""

import subprocess
import sys

from evoexp.batch import workers
from evoexp.numeric.garbage import NEW_OBJECTS


def test_the_server_looks_less_before_it_loads_anything() -> None:
    code = "import gc, sys, {}; print(gc.get_threshold()[0], 'numpy' in sys.modules)"
    first = workers._PRELOADED[0]
    said = subprocess.run(
        [sys.executable, "-c", code.format(first)], capture_output=True, text=True, check=True
    ).stdout.split()
    assert said == [str(NEW_OBJECTS), "False"]
