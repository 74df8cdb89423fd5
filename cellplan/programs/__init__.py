"""Programs for controllers: made from a verified run, and judged once more as they are written."""
