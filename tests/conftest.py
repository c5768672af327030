"""Settings of every test: property tests draw the same examples each time.

And no time is an assertion.
"""

from hypothesis import settings

settings.register_profile("evoexp", deadline=None, derandomize=True, database=None)
settings.load_profile("evoexp")
