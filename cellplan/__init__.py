"""cellplan: offline programming and cell layout for cooperative robots that work on one moving part."""

import os

for _name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # the matrices are small; before numpy is imported, or it has no effect

__version__ = "0.1.0"
