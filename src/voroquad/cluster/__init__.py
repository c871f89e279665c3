"""Studies, comparisons and renders on Dask: the same bits from any number of workers.

Any ``distributed.Client`` will do:

>>> from distributed import Client                                            # doctest: +SKIP
>>> from voroquad.cluster import OnDask, Store
>>> from voroquad.study.run import run_study
>>> pool = OnDask(Client("tcp://10.0.0.1:8786"), Store("s3://bucket/run"))  # doctest: +SKIP
>>> run_study("out", replicates=1_000_000, pool=pool)                         # doctest: +SKIP
"""

from __future__ import annotations

try:
    from .connect import attached, connected
    from .on_dask import OnDask
    from .store import Store
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(f"running in units needs {error.name!r}", name=error.name) from None

__all__ = ["OnDask", "Store", "attached", "connected"]
