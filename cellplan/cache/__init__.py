"""Cache: what is long in the making and follows from the bytes of its inputs alone is kept from run to run."""

from cellplan.cache.store import Key, keep, key_of, recall
from cellplan.cache.use import as_here, nothing_kept

__all__ = ["Key", "as_here", "keep", "key_of", "nothing_kept", "recall"]
