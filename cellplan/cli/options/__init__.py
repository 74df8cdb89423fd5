"""Options: declared once each as fields of frozen classes, completed by shells, refused where they say nothing."""
