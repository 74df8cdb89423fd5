"""Cache: results that take long to compute and depend on the bytes of their inputs alone."""

from cellplan.cache.store import Key, as_here, keep, key_of, recall, without_cache

__all__ = ["Key", "as_here", "keep", "key_of", "recall", "without_cache"]
