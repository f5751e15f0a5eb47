"""Where a piecewise linear map bends, and by how much."""
