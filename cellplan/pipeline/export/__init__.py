"""Export: from a verified run to programs for controllers, judged once more as they are written."""
