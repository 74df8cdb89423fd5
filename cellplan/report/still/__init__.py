"""Picture of one instant of a cell as SVG text: solids in front of each other, shaded, with what matters marked."""
