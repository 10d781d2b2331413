"""``python -m ndf`` is the program ``ndf``."""

import sys

from ndf._program import main

if __name__ == "__main__":
    sys.exit(main())
