"""The libraries that worker processes are forked with: importing this module loads them.

One kernel is called as well: at the first call numba sets up what all compiled kernels need. All
that is loaded then stays. Workers do not look through it for garbage: a search takes a sixteenth of
a second in each of them, as every page that it touches is copied.
"""

import gc

import coal  # noqa: F401
import numpy as np
import pinocchio  # noqa: F401
from joblib.externals.loky import process_executor  # noqa: F401

from evoexp.batch import jobs, replicate  # noqa: F401
from evoexp.evolution.cost_statistics import cost_statistics
from evoexp.numeric.kept_files import damage_left_alone

with damage_left_alone():  # the parent finds it, and says so
    cost_statistics(np.zeros(1))
gc.freeze()
