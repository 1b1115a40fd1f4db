"""Many recordings: which were named, the same work for each, and what is told of them."""
