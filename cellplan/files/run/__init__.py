"""Run folders: joint tables, manifest, atomic writing, reading back."""
