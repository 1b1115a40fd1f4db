"""Angle sensors beside the arm's own: read, published as `angle/<source>`, and compared as in the paper (Table I)."""
