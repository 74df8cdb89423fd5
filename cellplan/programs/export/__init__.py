"""Export of verified runs: chosen, prepared, written, recorded, and verified on disk."""
