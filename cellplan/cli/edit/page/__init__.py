"""The page of the live cell: the view page's picture, time line and lists, and what a session adds."""
