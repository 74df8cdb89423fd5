"""The structure of a cell explained: coupling graph, circuits, and the rank of its cooperation Jacobian."""
