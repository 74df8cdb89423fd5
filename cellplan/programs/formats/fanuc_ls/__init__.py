"""TP programs of FANUC controllers as text (.ls): motion groups and names, writer and reader."""
