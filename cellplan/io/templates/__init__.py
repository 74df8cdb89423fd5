"""Cells to begin with: what ``cellplan init`` writes into a folder."""

from cellplan.io.templates.catalogue import TEMPLATES, Template, template_named
from cellplan.io.templates.content import template_files
from cellplan.io.templates.folder import refuse_unless_empty, write_folder

__all__ = ["TEMPLATES", "Template", "refuse_unless_empty", "template_files", "template_named", "write_folder"]
