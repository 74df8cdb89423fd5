"""RAPID of ABB controllers: writer, targets and reader."""
