"""Cells to begin with: what ``cellplan init`` writes into a folder."""

from cellplan.files.templates.catalogue import TEMPLATES, Template, template_named
from cellplan.files.templates.folder import refuse_unless_empty, template_files, write_folder

__all__ = ["TEMPLATES", "Template", "refuse_unless_empty", "template_files", "template_named", "write_folder"]
