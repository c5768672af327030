"""Has Python look for garbage rarely, from its import on.

The server of workers loads this module before all others, and workers are forked from it.
"""

from evoexp.numeric.garbage import search_less

search_less()
