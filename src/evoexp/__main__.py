"""`python -m evoexp`."""

import sys

from evoexp.cli import main

sys.exit(main())
