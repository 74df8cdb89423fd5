"""Cache: what is long in the making and follows from the bytes of its inputs alone is kept from run to run."""

from cellplan.cache.entries import Key, keep, key_of, recall

__all__ = ["Key", "keep", "key_of", "recall"]
