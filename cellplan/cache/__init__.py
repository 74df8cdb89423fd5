"""Cache: results that take long to compute and depend on the bytes of their inputs alone."""

from cellplan.cache.store import Key, keep, key_of, recall
from cellplan.cache.use import as_here, nothing_kept

__all__ = ["Key", "as_here", "keep", "key_of", "nothing_kept", "recall"]
