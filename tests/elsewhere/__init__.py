"""What other systems lack, taken away from a running interpreter."""
