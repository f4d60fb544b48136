"""Browser-based commissioning of AGVs that localize on reflectors with a safety laser."""

import os

# Our matrices have a few dozen rows, and what is large runs in kernels of our own. Spread over all cores, each of them
# makes threads wait for each other: with the cores busy, fitting the motion of a contour took five times as long. It is
# asked once, when numpy is loaded, so this stands before everything else. Who sets it is obeyed.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

__version__ = "0.1.0"
