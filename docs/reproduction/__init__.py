"""The published figures of the three papers, computed anew: one file per paper, one for drawing, one for the page."""
